(** Plants: how far real motion leaves the straight line of the command, and the body the point that the law steers.

    For Budget.v:                          drift      dip                          cover
      unicycle, chord steering             0          |omega| |(v, l omega)| h^2 / 8   l
      first-order lag                      0          0                            tau V
    Some bodies are drawn after the point that the law steers and need less than a cover. Where the points keep [m], the
    bodies keep
      lag          sqrt ((m - |ti - tau| Vi - |tj - tau| Vj)^2 - (tau Vrel)^2)     [lag_pair]
      unicycle     sqrt (m^2 - l^2) from a set at rest, if it never drives backwards     [forwards]
    In a period time is counted from its sample. Such motions of a unicycle exist ([arc], and [steering_exists] in
    Turning.v); for lags this is not proved. *)
Require Import Reals Lra Psatz Safety Convex Pieces.
Local Open Scope R_scope.

(** * A unicycle that steers a hand point, [l] ahead of its axle *)

(** The vector [(a, b)] of the body frame, in the world, at heading [th]. *)
Definition turn th a b := V (a * cos th - b * sin th) (a * sin th + b * cos th) 0.
Definition speed a b := sqrt (a * a + b * b).

Lemma speed_nonneg a b : 0 <= speed a b.
Proof. apply sqrt_pos. Qed.

Lemma norm_turn th a b : norm (turn th a b) = speed a b.
Proof.
  unfold norm, speed, turn, dot; simpl; f_equal; pose proof (sin2_cos2 th) as T; unfold Rsqr in T.
  replace ((a * cos th - b * sin th) * (a * cos th - b * sin th) + (a * sin th + b * cos th) * (a * sin th + b * cos th)
    + 0 * 0) with ((a * a + b * b) * (sin th * sin th + cos th * cos th)) by ring; rewrite T; ring.
Qed.

Lemma norm_ahead th l : 0 <= l -> norm (turn th l 0) = l.
Proof.
  intros L; rewrite norm_turn; unfold speed; replace (l * l + 0 * 0) with (l * l) by ring; apply sqrt_square, L.
Qed.

Lemma turn_velocity th om a b r :
  velocity (fun r => turn (th + om * r) a b) r (scale om (turn (th + om * r) (- b) a)).
Proof.
  pose proof (line_derivative th om r) as L.
  pose proof (derivable_pt_lim_comp _ _ r _ _ L (derivable_pt_lim_cos (th + om * r))) as C.
  pose proof (derivable_pt_lim_comp _ _ r _ _ L (derivable_pt_lim_sin (th + om * r))) as S.
  unfold comp in C, S; split; [| split]; unfold turn, scale; simpl.
  - pose proof (derivable_pt_lim_minus _ _ r _ _ (derivable_pt_lim_scal _ a r _ C)
      (derivable_pt_lim_scal _ b r _ S)) as P.
    match type of P with derivable_pt_lim _ _ ?x => match goal with |- derivable_pt_lim _ _ ?y =>
      replace y with x by ring end end; exact P.
  - pose proof (derivable_pt_lim_plus _ _ r _ _ (derivable_pt_lim_scal _ a r _ S)
      (derivable_pt_lim_scal _ b r _ C)) as P.
    match type of P with derivable_pt_lim _ _ ?x => match goal with |- derivable_pt_lim _ _ ?y =>
      replace y with x by ring end end; exact P.
  - rewrite Rmult_0_r; apply derivable_pt_lim_const.
Qed.

(** How much the velocity of the hand point changes. *)
Lemma turn_changes th om a b r r' : 0 <= r <= r' ->
  norm (sub (turn (th + om * r) a b) (turn (th + om * r') a b)) <= Rabs om * speed a b * (r' - r).
Proof.
  intros Hr; set (q := fun s => turn (th + om * r + om * s) a b); rewrite norm_sym.
  replace (sub (turn (th + om * r') a b) (turn (th + om * r) a b)) with (sub (q (r' - r)) (q 0))
    by (unfold q; do 2 f_equal; ring).
  pose proof (smooth q _ (r' - r) (turn_velocity (th + om * r) om a b)) as G.
  apply (moves_at_most _ _ _ _ _ G); [| apply Rmult_le_pos; [apply Rabs_pos | apply speed_nonneg] | lra].
  intros s _; set (w := turn (th + om * r + om * s) (- b) a).
  assert (W : norm w = speed a b) by (unfold w; rewrite norm_turn; unfold speed; f_equal; ring).
  rewrite <- W; unfold Rabs; destruct Rcase_abs; [| right; apply norm_scale; lra].
  rewrite <- norm_scale, <- norm_opposite by lra; right; f_equal; vectors; f_equal; ring.
Qed.

(** The motion at constant [v] and [om] exists: a circle or a line. *)
Lemma arc th om v w : exists q, forall r, velocity q r (turn (th + om * r) v w).
Proof.
  destruct (Req_dec om 0) as [O | O].
  - exists (fun r => scale r (turn th v w)); intros r; rewrite O, Rmult_0_l, Rplus_0_r; apply line_velocity.
  - exists (fun r => turn (th + om * r) (w / om) (- (v / om))); intros r.
    pose proof (turn_velocity th om (w / om) (- (v / om)) r) as T.
    replace (turn (th + om * r) v w) with (scale om (turn (th + om * r) (- - (v / om)) (w / om))); [exact T |].
    unfold scale, turn; simpl; f_equal; field; exact O.
Qed.

(** ** Chord steering: the speed [v] and the turning rate [om] with which the hand point *arrives* where the command
    leads, [(a, b)] in the body frame. A command with [b <> 0] has to be one with [0 < 2 l + a h]. *)
Definition chord_steering l h a b om v := let be := atan (b * h / (2 * l + a * h)) in
  (b <> 0 -> 0 < 2 * l + a * h) /\ om = 2 * be / h /\ v * sin be = (a * cos be + b * sin be) * be /\ (b = 0 -> v = a).

Lemma straight l h a om v : 0 < h -> chord_steering l h a 0 om v -> om = 0 /\ v = a.
Proof.
  intros Hh [_ [-> [_ V0]]]; split; [| apply V0; reflexivity].
  replace (0 * h / (2 * l + a * h)) with 0 by (unfold Rdiv; ring); rewrite atan_0; field; lra.
Qed.

Section Chord.

Variables (p : R -> vec) (th om v l h a b : R).
Hypotheses (h_positive : 0 < h) (steers : chord_steering l h a b om v).
Hypothesis hand : goes p (fun r => turn (th + om * r) v (l * om)) h.

Lemma arrives_straight : b = 0 -> forall s, 0 <= s <= h -> sub (p s) (p 0) = scale s (turn th a b).
Proof.
  intros B s Hs; revert steers; rewrite B; intros C; destruct (straight l h a om v h_positive C) as [O E].
  rewrite (same_motion p (fun r => scale r (turn th a 0)) _ h s hand); [vectors; f_equal; ring | | exact Hs].
  apply smooth; intros r; rewrite O, E, Rmult_0_l, Rplus_0_r, Rmult_0_r; apply line_velocity.
Qed.

Lemma arrives_on_arc : b <> 0 -> sub (p h) (p 0) = scale h (turn th a b).
Proof.
  intros B; destruct steers as [ahead [om_is [v_is _]]]; specialize (ahead B).
  set (be := atan (b * h / (2 * l + a * h))) in *.
  assert (C : 0 < cos be) by (apply cos_gt_0; unfold be; destruct (atan_bound (b * h / (2 * l + a * h))); lra).
  assert (tangent : (2 * l + a * h) * sin be = b * h * cos be).
  { assert (T : tan be = b * h / (2 * l + a * h)) by (unfold be; apply tan_atan || apply atan_right_inv).
    unfold tan in T; replace (sin be) with (sin be / cos be * cos be) by (field; lra); rewrite T; field; lra. }
  assert (S : sin be <> 0).
  { intros S; rewrite S in tangent; assert (Z : b * (h * cos be) = 0) by lra.
    apply Rmult_integral in Z; destruct Z as [Z | Z]; [exact (B Z) |].
    assert (0 < h * cos be) by (apply Rmult_lt_0_compat; lra); lra. }
  assert (O : om <> 0).
  { intros Z; apply S; replace be with 0; [apply sin_0 |]; apply Rmult_eq_reg_l with (2 / h);
      [rewrite Rmult_0_r, <- Z, om_is; field; lra | apply Rgt_not_eq, Rdiv_lt_0_compat; lra]. }
  set (q := fun r => turn (th + om * r) l (- (v / om))).
  assert (Q : goes q (fun r => turn (th + om * r) v (l * om)) h).
  { apply smooth; intros r; pose proof (turn_velocity th om l (- (v / om)) r) as T.
    replace (turn (th + om * r) v (l * om)) with (scale om (turn (th + om * r) (- - (v / om)) l)); [exact T |].
    unfold scale, turn; simpl; f_equal; field; exact O. }
  rewrite (same_motion p q _ h h hand Q) by lra; unfold q; rewrite Rmult_0_r, Rplus_0_r.
  replace (th + om * h) with (th + (be + be)) by (rewrite om_is; field; lra).
  assert (VO : v / om = (a * cos be + b * sin be) * (h / (2 * sin be))).
  { apply Rmult_eq_reg_r with (om * sin be); [| apply Rmult_integral_contrapositive; auto].
    transitivity (v * sin be); [field; exact O |]; rewrite v_is, om_is; field; split; [lra | exact S]. }
  assert (LL : l = (b * cos be - a * sin be) * (h / (2 * sin be))).
  { apply Rmult_eq_reg_r with (2 * sin be); [| lra].
    transitivity (b * h * cos be - a * h * sin be); [rewrite <- tangent; ring | field; exact S]. }
  rewrite VO; pattern l at 1 2; rewrite LL; unfold turn, sub, scale; simpl.
  rewrite !cos_plus, !sin_plus, !cos_plus; pose proof (sin2_cos2 be) as T; unfold Rsqr in T.
  assert (CC : cos be * cos be = 1 - sin be * sin be) by lra.
  set (c := cos be) in *; set (s := sin be) in *; set (x := cos th); set (y := sin th); set (k := h / (2 * s)).
  assert (HK : h = 2 * s * k) by (unfold k; field; exact S); clearbody c s x y k; clear - HK CC.
  f_equal; [| | ring]; rewrite HK; ring [CC].
Qed.

(** THEOREM: With chord steering the hand point of a unicycle arrives exactly where the command leads; its dip is known.
    - Speed and turning rate are those of chord steering, and constant in a period.
    - Positions do not jump, and have the plant's derivatives inside the periods.
    Silent on: Slip, and errors of the heading. *)
Theorem chord : sub (p h) (p 0) = scale h (turn th a b) /\
  forall s, 0 <= s <= h -> norm (sub (sub (p s) (p 0)) (scale s (turn th a b))) <= Rabs om * speed v (l * om) * (h *
    h) / 8.
Proof.
  assert (A : sub (p h) (p 0) = scale h (turn th a b)).
  { destruct (Req_dec b 0) as [B | B]; [apply (arrives_straight B); lra | exact (arrives_on_arc B)]. }
  split; [exact A |]; intros s Hs.
  assert (M : 0 <= Rabs om * speed v (l * om)) by (apply Rmult_le_pos; [apply Rabs_pos | apply speed_nonneg]).
  destruct (leaves_chord p _ (turn th a b) _ h s Hs M hand) as [P Q]; [intros; apply turn_changes; lra | exact A | lra].
Qed.

End Chord.

(** THEOREM: A unicycle that is told to stand neither turns nor drives.
    - Speed and turning rate are those of chord steering, and constant in a period.
    - Positions do not jump, and have the plant's derivatives inside the periods. *)
Theorem unicycle_stands axle th om v l h : 0 < h -> chord_steering l h 0 0 om v ->
  goes axle (fun r => turn (th + om * r) v 0) h -> om = 0 /\ forall s, 0 <= s <= h -> axle s = axle 0.
Proof.
  intros Hh C [G D]; destruct (straight l h 0 om v Hh C) as [O V0]; split; [exact O |]; intros s Hs.
  apply (stays axle h s); [| exact Hs]; split; [exact G |]; intros r Hr; specialize (D r Hr); rewrite V0 in D.
  unfold turn in D; rewrite !Rmult_0_l, Rminus_0_r, Rplus_0_r in D; exact D.
Qed.

(** ** Never backwards: the axle is drawn after the hand point. In each period the unicycle drives at a speed [v >= 0]
    of its own. *)
Lemma forwards_period inside axle th v l m h s : 0 < l -> 0 <= m -> 0 <= v -> 0 <= s <= h ->
  goes axle (fun r => turn (th r) v 0) h -> (forall r, 0 <= r <= h -> clear inside m (add (axle r) (turn (th r) l 0)))
    ->
  clear inside (sqrt (m * m - l * l)) (axle 0) -> clear inside (sqrt (m * m - l * l)) (axle s).
Proof.
  intros Hl Hm Hv Hs G Hz H0; destruct (Req_dec v 0) as [V0 | V0].
  - rewrite (stays axle h s); [exact H0 | | exact Hs]; destruct G as [C D]; split; [exact C |]; intros r Hr.
    specialize (D r Hr); rewrite V0 in D; unfold turn in D; rewrite !Rmult_0_l, Rminus_0_r, Rplus_0_r in D; exact D.
  - set (z := fun r => add (axle r) (turn (th r) l 0)).
    assert (Z : forall r, sub (z r) (axle r) = turn (th r) l 0)
      by (intros; unfold z, turn; destruct (axle r); vectors; f_equal; ring).
    apply (follows inside axle z (l / v) l m s); [apply Rdiv_lt_0_compat; lra | exact Hm | lra | | | | exact H0].
    + destruct (goes_less _ _ h s G ltac:(lra)) as [C D]; split; [exact C |]; intros r Hr; rewrite Z.
      replace (scale (/ (l / v)) (turn (th r) l 0)) with (turn (th r) v 0); [exact (D r Hr) |].
      unfold turn, scale; simpl; f_equal; field; lra.
    + intros r _; rewrite Z, norm_ahead; lra.
    + intros r Hr; apply Hz; lra.
Qed.

(** * Many periods *)
Section Periods.

(** The [N] periods from the sample [K] on. *)
Variables (h : R) (K N : nat).
Hypothesis h_positive : 0 < h.
Notation sample := (sample h).

(** What is true at the first sample, and in a period if it is true at its sample, is true in all periods. *)
Lemma period_by_period (P : R -> Prop) : P (sample K) ->
  (forall k s, (K <= k < K + N)%nat -> 0 <= s <= h -> P (sample k) -> P (sample k + s)) ->
  forall k s, (K <= k < K + N)%nat -> 0 <= s <= h -> P (sample k + s).
Proof.
  intros P0 H; assert (Q : forall k, (K <= k)%nat -> (k < K + N)%nat -> P (sample k)).
  { intros k F; induction F as [| k F IH]; intros Hk; [exact P0 |].
    rewrite next; apply H; [lia | lra | apply IH; lia]. }
  intros k s Hk Hs; apply H; [exact Hk | exact Hs | apply Q; lia].
Qed.

(** THEOREM: The axle of a unicycle that never drives backwards keeps sqrt(m^2 - l^2) from sets that its hand point
    keeps m from.
    - It drives at v >= 0, a speed for each period.
    - The set is at rest.
    - It starts there.
    - Positions do not jump, and have the plant's derivatives inside the periods.
    Silent on: Anything about other robots, or about sets that move: there the cover l stays. *)
Theorem forwards inside axle th v l m : 0 < l -> 0 <= m -> (forall k, (K <= k < K + N)%nat -> 0 <= v k /\
    goes (fun r => axle (sample k + r)) (fun r => turn (th (sample k + r)) (v k) 0) h) ->
  (forall k s, (K <= k < K + N)%nat -> 0 <= s <= h -> let t := sample k + s in
    clear inside m (add (axle t) (turn (th t) l 0))) ->
  clear inside (sqrt (m * m - l * l)) (axle (sample K)) ->
  forall k s, (K <= k < K + N)%nat -> 0 <= s <= h -> clear inside (sqrt (m * m - l * l)) (axle (sample k + s)).
Proof.
  intros Hl Hm Hv Hz H0; apply (period_by_period (fun t => clear inside (sqrt (m * m - l * l)) (axle t)) H0).
  intros k s Hk Hs H; destruct (Hv k Hk) as [V0 G].
  apply (forwards_period inside (fun r => axle (sample k + r)) (fun r => th (sample k + r)) (v k) l m h s);
    [exact Hl | exact Hm | exact V0 | exact Hs | exact G | |].
  - intros r Hr; exact (Hz k r Hk Hr).
  - rewrite Rplus_0_r; exact H.
Qed.

(** * First-order lag: the velocity [v] of a body goes towards its command, v' = (u - v) / tau. The law steers the point
    [p + tau v], where the body would come to rest. *)

(** THEOREM: The point p + tau v of a body with lag moves exactly as commanded.
    - The velocity goes towards the command at the rate (u - v)/tau.
    - Positions do not jump, and have the plant's derivatives inside the periods.
    Silent on: What a wrong tau costs: that is a drift. *)
Theorem lag p v u tau s : 0 < tau -> goes p v h -> goes v (fun r => scale (/ tau) (sub u (v r))) h -> 0 <= s <= h ->
  sub (add (p s) (scale tau (v s))) (add (p 0) (scale tau (v 0))) = scale s u.
Proof.
  intros Ht Hp Hv Hs; pose proof (goes_add p v v _ tau h Hp Hv) as [C D].
  pose proof (same_motion (fun r => add (p r) (scale tau (v r))) (fun r => scale r u) (fun _ => u) h s) as E;
    cbv beta in E.
  rewrite E; [vectors; f_equal; ring | | apply smooth; intros; apply line_velocity | exact Hs].
  split; [exact C |]; intros r Hr; specialize (D r Hr); cbv beta in D.
  replace (add (v r) (scale tau (scale (/ tau) (sub u (v r))))) with u in D; [exact D |].
  destruct u, (v r); vectors; f_equal; field; lra.
Qed.

(** THEOREM: A body with lag is never faster than the limit of its commands.
    - The velocity goes towards the command at the rate (u - v)/tau.
    - Positions do not jump, and have the plant's derivatives inside the periods.
    - It is no faster at the start. *)
Theorem lag_speed v u tau top : 0 < tau ->
  (forall k, (K <= k < K + N)%nat ->
    goes (fun r => v (sample k + r)) (fun r => scale (/ tau) (sub (u k) (v (sample k + r)))) h) ->
  (forall k, (K <= k < K + N)%nat -> norm (u k) <= top) -> norm (v (sample K)) <= top ->
  forall k s, (K <= k < K + N)%nat -> 0 <= s <= h -> norm (v (sample k + s)) <= top.
Proof.
  intros Ht Hv Hu H0; apply (period_by_period (fun t => norm (v t) <= top) H0); intros k s Hk Hs H.
  assert (0 <= top) by (pose proof (norm_nonneg (v (sample k))); lra).
  apply norm_below; [intros n U | lra]; set (m := scale (-1) n).
  assert (O : forall w, dot m w = - dot n w) by (intros; unfold m; vectors; ring).
  assert (L : forall w, norm w <= top -> - top <= dot m w) by (intros w Hw; rewrite O; pose proof (unit_dot n w U);
    lra).
  enough (Q : - top <= dot m (v (sample k + s))) by (rewrite O in Q; lra).
  destruct (dot_goes _ _ s m (goes_less _ _ h s (Hv k Hk) ltac:(lra))) as [C D].
  apply (pulled (fun r => dot m (v (sample k + r))) (fun _ => dot m (u k)) _ tau s Ht); [lra | | exact C | |].
  - intros r Hr; specialize (D r Hr); cbv beta in D.
    replace (/ tau * (dot m (u k) - dot m (v (sample k + r))))
      with (dot m (scale (/ tau) (sub (u k) (v (sample k + r))))) by (vectors; ring); exact D.
  - intros r _; apply L, Hu, Hk.
  - rewrite Rplus_0_r; apply L, H.
Qed.

(** ** Two bodies with lags [ti] and [tj], 0 for none. They are drawn after the points that the law steers; [tau] is of
    the reader's choice, [ti] or the larger of the two. A set at rest has no velocity. *)
(** THEOREM: Where the points steered keep m, two bodies with lags keep sqrt(b^2 - (tau V_rel)^2), b = m - |tau_i - tau|
    V_i - |tau_j - tau| V_j.
    - tau is positive, of your choice, and b not negative.
    - Speeds and relative speed are within their limits.
    - They start there.
    - Positions do not jump, and have the plant's derivatives inside the periods. *)
Theorem lag_pair inside pi pj vi vj ti tj tau Vi Vj Vrel m : 0 < tau ->
  (forall k, (K <= k < K + N)%nat -> goes (fun r => pi (sample k + r)) (fun r => vi (sample k + r)) h /\
    goes (fun r => pj (sample k + r)) (fun r => vj (sample k + r)) h) ->
  (forall k s, (K <= k < K + N)%nat -> 0 < s < h -> norm (vi (sample k + s)) <= Vi /\ norm (vj (sample k + s)) <= Vj /\
    norm (sub (vi (sample k + s)) (vj (sample k + s))) <= Vrel) ->
  (forall k s, (K <= k < K + N)%nat -> 0 <= s <= h -> let t := sample k + s in
    clear inside m (sub (add (pi t) (scale ti (vi t))) (add (pj t) (scale tj (vj t))))) ->
  let b := m - Rabs (ti - tau) * Vi - Rabs (tj - tau) * Vj in 0 <= b ->
  let kept := sqrt (b * b - (tau * Vrel) * (tau * Vrel)) in
  clear inside kept (sub (pi (sample K)) (pj (sample K))) -> forall k s, (K <= k < K + N)%nat -> 0 <= s <= h ->
  clear inside kept (sub (pi (sample k + s)) (pj (sample k + s))).
Proof.
  intros Ht Hg Sp Hz b Hb kept H0; apply (period_by_period (fun t => clear inside kept (sub (pi t) (pj t))) H0).
  intros k s Hk Hs H; set (p := fun r => sub (pi (sample k + r)) (pj (sample k + r))).
  set (w := fun r => sub (vi (sample k + r)) (vj (sample k + r))); set (z := fun r => add (p r) (scale tau (w r))).
  assert (Off : forall a v top, norm v <= top -> norm (scale a v) <= Rabs a * top).
  { intros a v top Hv; pose proof (norm_nonneg v); unfold Rabs; destruct Rcase_abs; [| rewrite norm_scale by lra; nra].
    replace (scale a v) with (scale (-1) (scale (- a) v)) by (vectors; f_equal; ring).
    rewrite norm_opposite, norm_scale by lra; nra. }
  assert (Z : forall r, sub (z r) (p r) = scale tau (w r)).
  { intros; unfold z; destruct (p r), (w r); vectors; f_equal; ring. }
  apply (follows inside p z tau (tau * Vrel) b s Ht Hb); [lra | | | |].
  - destruct (Hg k Hk) as [Gi Gj]; pose proof (goes_less _ _ h s (goes_sub _ _ _ _ h Gi Gj) ltac:(lra)) as [C D].
    split; [exact C |]; intros r Hr; rewrite Z.
    replace (scale (/ tau) (scale tau (w r))) with (w r) by (destruct (w r); vectors; f_equal; field; lra).
    exact (D r Hr).
  - intros r Hr; rewrite Z, norm_scale by lra; apply Rmult_le_compat_l; [lra |]; apply (Sp k r Hk); lra.
  - intros r Hr c Hc; specialize (Hz k r Hk ltac:(lra) c Hc); cbv zeta in Hz; set (t := sample k + r) in *.
    pose proof (nearly (sub (z r) c) (sub (sub (add (pi t) (scale ti (vi t))) (add (pj t) (scale tj (vj t)))) c)) as Q.
    match type of Q with _ - norm ?x <= _ => replace x with (add (scale (tau - ti) (vi t)) (scale (tj - tau) (vj t)))
      in Q
      by (unfold z, p, w; fold t; destruct (pi t), (pj t), (vi t), (vj t), c; vectors; f_equal; ring) end.
    destruct (Sp k r Hk ltac:(lra)) as [Si [Sj _]]; fold t in Si, Sj.
    pose proof (triangle (scale (tau - ti) (vi t)) (scale (tj - tau) (vj t))) as T.
    pose proof (Off (tau - ti) _ _ Si) as Oi; pose proof (Off (tj - tau) _ _ Sj) as Oj.
    rewrite (Rabs_minus_sym tau ti) in Oi; unfold b; lra.
  - unfold p; rewrite Rplus_0_r; exact H.
Qed.

End Periods.

(** * Input delay [delta]: the law steers the point [z] where the body [p] will be after all commands on their way. [wait]
    later the body is within what commands at [top] do in the difference of the two times. *)
(** THEOREM: A body with a delay is, some time later, within V |wait - delay| of the point that the law steers.
    - The law steers the point where the body will be after the commands on their way.
    - They are no faster than V. *)
Theorem delay (p z : R -> vec) delta wait top t : (forall r, p (r + delta) = z r) ->
  norm (sub (z (t + (wait - delta))) (z t)) <= top * Rabs (wait - delta) ->
  norm (sub (p (t + wait)) (z t)) <= top * Rabs (wait - delta).
Proof. intros P H; replace (t + wait) with (t + (wait - delta) + delta) by ring; rewrite P; exact H. Qed.

(** THEOREM: The distance of Plants.lag_pair is d or more if b is at least sqrt(d^2 + (tau V_rel)^2).
    - d is not negative. *)
Lemma lag_needs d a b : 0 <= d -> sqrt (d ^ 2 + a ^ 2) <= b -> d <= sqrt (b * b - a * a).
Proof.
  intros Hd Hb; assert (S : 0 <= d ^ 2 + a ^ 2) by nra; pose proof (sqrt_pos (d ^ 2 + a ^ 2));
    pose proof (sqrt_sqrt _ S).
  rewrite <- (sqrt_square d Hd); apply sqrt_le_1_alt; nra.
Qed.
