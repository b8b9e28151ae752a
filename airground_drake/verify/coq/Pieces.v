(** Motions in pieces: commands jump at every sample, and with them velocities or accelerations.

    A position has no jump at any time, and a velocity *inside* the periods: [goes]. What Plants.v needs is proved from
    that: [leaves_chord] (a motion that ends where a straight line ends is not far from it before), [same_motion] (one
    velocity, one motion), [follows] (a point that is drawn after another one). *)
Require Import Reals Lra Psatz Safety Convex.
Local Open Scope R_scope.

Definition continuous (p : R -> vec) r := continuity_pt (fun s => vx (p s)) r /\ continuity_pt (fun s => vy (p s)) r /\
  continuity_pt (fun s => vz (p s)) r.
Definition velocity (p : R -> vec) t v :=
  derivable_pt_lim (fun r => vx (p r)) t (vx v) /\ derivable_pt_lim (fun r => vy (p r)) t (vy v) /\
  derivable_pt_lim (fun r => vz (p r)) t (vz v).
(** From 0 to [h]: no jump, and the velocity [v] in between. *)
Definition goes (p v : R -> vec) h :=
  (forall r, 0 <= r <= h -> continuous p r) /\ (forall r, 0 < r < h -> velocity p r (v r)).

Lemma goes_less p v h s : goes p v h -> s <= h -> goes p v s.
Proof. intros [C D] Hs; split; intros r Hr; [apply C | apply D]; lra. Qed.

(** What has a velocity at every time has no jump. *)
Lemma smooth p v h : (forall r, velocity p r (v r)) -> goes p v h.
Proof.
  intros H; split; intros r _; [| apply H]; destruct (H r) as [X [Y Z]].
  split; [| split]; apply derivable_continuous_pt; eexists; eassumption.
Qed.

Lemma goes_add p v q w s h : goes p v h -> goes q w h ->
  goes (fun r => add (p r) (scale s (q r))) (fun r => add (v r) (scale s (w r))) h.
Proof.
  intros [Cp Dp] [Cq Dq]; split; intros r Hr.
  - destruct (Cp r Hr) as [X [Y Z]], (Cq r Hr) as [X' [Y' Z']]; split; [| split]; unfold add, scale; simpl.
    + exact (continuity_pt_plus _ _ r X (continuity_pt_scal _ s r X')).
    + exact (continuity_pt_plus _ _ r Y (continuity_pt_scal _ s r Y')).
    + exact (continuity_pt_plus _ _ r Z (continuity_pt_scal _ s r Z')).
  - destruct (Dp r Hr) as [X [Y Z]], (Dq r Hr) as [X' [Y' Z']]; split; [| split]; unfold add, scale; simpl.
    + exact (derivable_pt_lim_plus _ _ r _ _ X (derivable_pt_lim_scal _ s r _ X')).
    + exact (derivable_pt_lim_plus _ _ r _ _ Y (derivable_pt_lim_scal _ s r _ Y')).
    + exact (derivable_pt_lim_plus _ _ r _ _ Z (derivable_pt_lim_scal _ s r _ Z')).
Qed.

Lemma goes_sub p v q w h : goes p v h -> goes q w h -> goes (fun r => sub (p r) (q r)) (fun r => sub (v r) (w r)) h.
Proof.
  intros [Cp Dp] [Cq Dq]; split; intros r Hr.
  - destruct (Cp r Hr) as [X [Y Z]], (Cq r Hr) as [X' [Y' Z']]; split; [| split]; unfold sub; simpl.
    + exact (continuity_pt_minus _ _ r X X').
    + exact (continuity_pt_minus _ _ r Y Y').
    + exact (continuity_pt_minus _ _ r Z Z').
  - destruct (Dp r Hr) as [X [Y Z]], (Dq r Hr) as [X' [Y' Z']]; split; [| split]; unfold sub; simpl;
      apply derivable_pt_lim_minus; assumption.
Qed.

Lemma dot_goes p v h n : goes p v h -> (forall r, 0 <= r <= h -> continuity_pt (fun s => dot n (p s)) r) /\
  (forall r, 0 < r < h -> derivable_pt_lim (fun s => dot n (p s)) r (dot n (v r))).
Proof.
  intros [C D]; split; intros r Hr; unfold dot.
  - destruct (C r Hr) as [X [Y Z]].
    exact (continuity_pt_plus _ _ r (continuity_pt_plus _ _ r (continuity_pt_scal _ (vx n) r X)
      (continuity_pt_scal _ (vy n) r Y)) (continuity_pt_scal _ (vz n) r Z)).
  - destruct (D r Hr) as [X [Y Z]].
    exact (derivable_pt_lim_plus _ _ r _ _ (derivable_pt_lim_plus _ _ r _ _ (derivable_pt_lim_scal _ (vx n) _ _ X)
      (derivable_pt_lim_scal _ (vy n) _ _ Y)) (derivable_pt_lim_scal _ (vz n) _ _ Z)).
Qed.

Lemma line_derivative a b t : derivable_pt_lim (fun r => a + b * r) t b.
Proof.
  pose proof (derivable_pt_lim_plus _ _ t _ _ (derivable_pt_lim_const a t)
    (derivable_pt_lim_scal _ b t _ (derivable_pt_lim_id t))) as P; rewrite Rplus_0_l, Rmult_1_r in P; exact P.
Qed.

Lemma line_velocity u t : velocity (fun r => scale r u) t u.
Proof.
  assert (X : forall b, derivable_pt_lim (fun r => r * b) t b).
  { intros b e He; destruct (line_derivative 0 b t e He) as [d Hd]; exists d; intros k K1 K2; specialize (Hd k K1 K2).
    replace ((t + k) * b - t * b) with (0 + b * (t + k) - (0 + b * t)) by ring; exact Hd. }
  split; [| split]; unfold scale; simpl; apply X.
Qed.

Lemma constant_continuous (a r : R) : continuity_pt (fun _ => a) r.
Proof. apply continuity_pt_const; intros ? ?; reflexivity. Qed.

(** * Mean values *)
Lemma mean_value f f' a b : a < b -> (forall c, a < c < b -> derivable_pt_lim f c (f' c)) ->
  (forall c, a <= c <= b -> continuity_pt f c) -> exists c, f b - f a = f' c * (b - a) /\ a < c < b.
Proof.
  intros Hab D C; set (pr := fun c Hc => exist _ (f' c) (D c Hc) : derivable_pt f c).
  destruct (MVT f id a b pr (fun c _ => derivable_pt_id c) Hab C
    (fun c _ => derivable_continuous_pt id c (derivable_pt_id c))) as [c [P E]].
  exists c; split; [| exact P]; rewrite derive_pt_id in E; unfold id, pr, derive_pt in E; simpl in E; lra.
Qed.

(** A body that is no faster than [c] has moved by [c s] at most. *)
Lemma moves_at_most p v c h s : goes p v h -> (forall r, 0 < r < h -> norm (v r) <= c) -> 0 <= c -> 0 <= s <= h ->
  norm (sub (p s) (p 0)) <= c * s.
Proof.
  intros G Hc c0 Hs; apply norm_below; [intros n N | nra]; destruct (Req_dec s 0) as [-> | S].
  - replace (sub (p 0) (p 0)) with (V 0 0 0) by (vectors; f_equal; ring); vectors; lra.
  - destruct (dot_goes p v s n (goes_less p v h s G ltac:(lra))) as [C D].
    destruct (mean_value _ _ 0 s ltac:(lra) D C) as [r [E Hr]]; specialize (Hc r ltac:(lra)).
    replace (dot n (sub (p s) (p 0))) with (dot n (p s) - dot n (p 0)) by (vectors; ring).
    pose proof (unit_dot n (v r) N); nra.
Qed.

(** One velocity, one motion. *)
Lemma same_motion p q v h s : goes p v h -> goes q v h -> 0 <= s <= h -> sub (p s) (p 0) = sub (q s) (q 0).
Proof.
  intros P Q Hs; apply norm_zero.
  pose proof (moves_at_most _ _ 0 h s (goes_sub _ _ _ _ _ P Q)) as M; cbv beta in M; rewrite Rmult_0_l in M.
  replace (sub (sub (p s) (p 0)) (sub (q s) (q 0))) with (sub (sub (p s) (q s)) (sub (p 0) (q 0)))
    by (vectors; f_equal; ring).
  apply M; [| lra | exact Hs]; intros r _; right; rewrite <- norm_0; f_equal; vectors; f_equal; ring.
Qed.

(** A body with the velocity 0 stands. *)
Lemma stays p h s : goes p (fun _ => V 0 0 0) h -> 0 <= s <= h -> p s = p 0.
Proof.
  intros G Hs; apply norm_zero; pose proof (moves_at_most p _ 0 h s G) as M; rewrite Rmult_0_l in M.
  apply M; [| lra | exact Hs]; intros r _; rewrite norm_0; lra.
Qed.

(** THEOREM: A motion that arrives where its command leads is off the straight line by at most M h^2/8 in between.
    - M bounds its acceleration.
    - Positions do not jump, and have the plant's derivatives inside the periods. *)
Theorem leaves_chord p v u M h s : 0 <= s <= h -> 0 <= M -> goes p v h ->
  (forall r r', 0 <= r <= r' -> norm (sub (v r) (v r')) <= M * (r' - r)) -> sub (p h) (p 0) = scale h u ->
  norm (sub (sub (p s) (p 0)) (scale s u)) <= M * (s * (h - s)) / 2 /\ M * (s * (h - s)) / 2 <= M * (h * h) / 8.
Proof.
  intros Hs HM G HL E; split; [| pose proof (Rle_0_sqr (h - 2 * s)) as Q; unfold Rsqr in Q; nra].
  apply norm_below; [intros n N | assert (0 <= s * (h - s)) by nra; nra].
  destruct (dot_goes p v h n G) as [C D]; set (b := - (M / 2 * h) - dot n u).
  set (f := fun r => dot n (p r) + r * (b + M / 2 * r)); set (f' := fun r => dot n (v r) + (b + M * r)).
  assert (Df : forall r, 0 < r < h -> derivable_pt_lim f r (f' r)).
  { intros r Hr; apply (derivable_pt_lim_plus (fun r => dot n (p r))); [exact (D r Hr) |].
    pose proof (derivable_pt_lim_mult _ _ r _ _ (derivable_pt_lim_id r) (line_derivative b (M / 2) r)) as P.
    replace (b + M * r) with (1 * (b + M / 2 * r) + id r * (M / 2)) by (unfold id; field); exact P. }
  assert (Cf : forall r, 0 <= r <= h -> continuity_pt f r).
  { intros r Hr; apply (continuity_pt_plus (fun r => dot n (p r))); [exact (C r Hr) |].
    apply (continuity_pt_mult id (fun r => b + M / 2 * r)); apply derivable_continuous_pt;
      [apply derivable_pt_id | exists (M / 2); apply line_derivative]. }
  assert (Up : forall r r', 0 < r <= r' -> f' r <= f' r').
  { intros r r' Hr; specialize (HL r r' ltac:(lra)); pose proof (unit_dot n (sub (v r) (v r')) N) as U.
    replace (dot n (sub (v r) (v r'))) with (dot n (v r) - dot n (v r')) in U by (vectors; ring); unfold f'; lra. }
  assert (F : f h = f 0).
  { unfold f, b; assert (dot n (p h) - dot n (p 0) = h * dot n u)
      by (transitivity (dot n (sub (p h) (p 0))); [vectors; ring | rewrite E; vectors; ring]); nra. }
  replace (dot n (sub (sub (p s) (p 0)) (scale s u))) with (f s - f 0 + M * (s * (h - s)) / 2)
    by (unfold f, b; vectors; field).
  enough (f s <= f 0) by lra.
  destruct (Req_dec s 0) as [-> | S0]; [lra |]; destruct (Req_dec s h) as [-> | S1]; [lra |].
  destruct (mean_value f f' 0 s ltac:(lra)) as [c1 [E1 C1]]; [intros; apply Df; lra | intros; apply Cf; lra |].
  destruct (mean_value f f' s h ltac:(lra)) as [c2 [E2 C2]]; [intros; apply Df; lra | intros; apply Cf; lra |].
  specialize (Up c1 c2 ltac:(lra)); apply Rnot_lt_le; intros L.
  assert (0 < f' c1) by (apply Rmult_lt_reg_r with (s - 0); lra).
  assert (0 < f' c2 * (h - s)) by (apply Rmult_lt_0_compat; lra); lra.
Qed.

(** * A point that is drawn after another one *)

(** What is pulled towards something that is at least [b], and is at least [b] now, stays at least [b]. *)
Lemma pulled f g b tau s : 0 < tau -> 0 <= s -> (forall r, 0 < r < s -> derivable_pt_lim f r (/ tau * (g r - f r))) ->
  (forall r, 0 <= r <= s -> continuity_pt f r) -> (forall r, 0 < r < s -> b <= g r) -> b <= f 0 -> b <= f s.
Proof.
  intros Ht Hs Hf C H H0; destruct (Req_dec s 0) as [-> | N]; [exact H0 |].
  assert (T : 0 < / tau) by (apply Rinv_0_lt_compat; lra); set (e := fun r => exp (0 + / tau * r)).
  assert (X : forall c, derivable_pt_lim e c (e c * / tau)).
  { intros c; exact (derivable_pt_lim_comp _ _ c _ _ (line_derivative 0 (/ tau) c) (derivable_pt_lim_exp _)). }
  destruct (mean_value (fun r => e r * (f r - b)) (fun r => e r * / tau * (f r - b) + e r * (/ tau * (g r - f r) - 0))
    0 s ltac:(lra)) as [c [E Hc]].
  - intros c Hc; apply (derivable_pt_lim_mult e (fun r => f r - b)); [apply X |].
    apply (derivable_pt_lim_minus f (fun _ => b)); [apply Hf; lra | apply derivable_pt_lim_const].
  - intros c Hc; apply (continuity_pt_mult e (fun r => f r - b)).
    + apply derivable_continuous_pt; eexists; apply X.
    + apply (continuity_pt_minus f (fun _ => b)); [apply C, Hc | apply constant_continuous].
  - specialize (H c Hc); assert (P : 0 < e c) by apply exp_pos; assert (Ps : 0 < e s) by apply exp_pos.
    assert (0 <= e c * / tau * (f c - b) + e c * (/ tau * (g c - f c) - 0)).
    { replace (e c * / tau * (f c - b) + e c * (/ tau * (g c - f c) - 0)) with (e c * (/ tau * (g c - b))) by ring.
      apply Rmult_le_pos; [lra | apply Rmult_le_pos; lra]. }
    assert (E0 : e 0 = 1) by (unfold e; rewrite Rmult_0_r, Rplus_0_r; apply exp_0); rewrite E0 in E.
    assert (0 <= e s * (f s - b)) by nra; apply Rnot_lt_le; intros L; nra.
Qed.

(** The square of a distance. *)
Lemma square_goes p v h c : goes p v h ->
  (forall r, 0 <= r <= h -> continuity_pt (fun s => dot (sub (p s) c) (sub (p s) c)) r) /\
  (forall r, 0 < r < h -> derivable_pt_lim (fun s => dot (sub (p s) c) (sub (p s) c)) r (2 * dot (sub (p r) c) (v r))).
Proof.
  intros [C D]; split; intros r Hr; unfold dot, sub; simpl.
  - assert (S : forall f a, continuity_pt f r -> continuity_pt (fun s => (f s - a) * (f s - a)) r).
    { intros f a F; pose proof (continuity_pt_minus f (fun _ => a) r F (constant_continuous a r)) as G.
      exact (continuity_pt_mult _ _ r G G). }
    destruct (C r Hr) as [X [Y Z]].
    exact (continuity_pt_plus _ _ r (continuity_pt_plus _ _ r (S _ (vx c) X) (S _ (vy c) Y)) (S _ (vz c) Z)).
  - assert (S : forall f l a, derivable_pt_lim f r l ->
      derivable_pt_lim (fun s => (f s - a) * (f s - a)) r (2 * ((f r - a) * l))).
    { intros f l a F; pose proof (derivable_pt_lim_minus _ _ r _ _ F (derivable_pt_lim_const a r)) as M.
      pose proof (derivable_pt_lim_mult _ _ r _ _ M M) as Q; cbv beta in Q.
      match type of Q with derivable_pt_lim _ _ ?x => replace (2 * ((f r - a) * l)) with x end; [exact Q |].
      unfold minus_fct, fct_cte; ring. }
    destruct (D r Hr) as [X [Y Z]]; pose proof (derivable_pt_lim_plus _ _ r _ _ (derivable_pt_lim_plus _ _ r _ _
      (S _ _ (vx c) X) (S _ _ (vy c) Y)) (S _ _ (vz c) Z)) as P.
    match type of P with derivable_pt_lim _ _ ?x => match goal with |- derivable_pt_lim _ _ ?y =>
      replace y with x by ring end end; exact P.
Qed.

(** The square of the distance of [p] from each point of the set is pulled. *)
(** THEOREM: A point that is drawn after one that keeps m from a set at rest, within a of it, keeps sqrt(m^2 - a^2).
    - It starts there.
    - It moves straight towards the other one.
    - Positions do not jump, and have the plant's derivatives inside the periods.
    Silent on: Anything about sets that move. *)
Theorem follows inside p z tau a m t : 0 < tau -> 0 <= m -> 0 <= t ->
  goes p (fun r => scale (/ tau) (sub (z r) (p r))) t -> (forall r, 0 < r < t -> norm (sub (z r) (p r)) <= a) ->
  (forall r, 0 < r < t -> clear inside m (z r)) ->
  clear inside (sqrt (m * m - a * a)) (p 0) -> clear inside (sqrt (m * m - a * a)) (p t).
Proof.
  intros Ht Hm Ht0 G Ha Hz H0 c Hc; unfold norm; apply sqrt_le_1_alt; set (b := m * m - a * a) in *.
  destruct (square_goes p _ t c G) as [C D].
  apply (pulled (fun r => dot (sub (p r) c) (sub (p r) c))
    (fun r => dot (sub (z r) c) (sub (z r) c) - dot (sub (z r) (p r)) (sub (z r) (p r))) b tau t Ht Ht0);
      [| exact C | |].
  - intros r Hr; specialize (D r Hr).
    match type of D with derivable_pt_lim _ _ ?q => match goal with |- derivable_pt_lim _ _ ?q' =>
      replace q' with q by (vectors; ring) end end; exact D.
  - intros r Hr; rewrite <- !norm_square; specialize (Ha r Hr); specialize (Hz r Hr c Hc).
    pose proof (norm_nonneg (sub (z r) (p r))); unfold b; nra.
  - cbv beta; specialize (H0 c Hc); rewrite <- norm_square; pose proof (norm_nonneg (sub (p 0) c)).
    destruct (Rle_dec 0 b) as [B | B]; [pose proof (sqrt_sqrt b B); pose proof (sqrt_pos b); nra | nra].
Qed.
