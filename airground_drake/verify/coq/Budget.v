(** The distance budget: what errors of motion and measurement cost.

    The law of Safety.v is evaluated with what was *measured*, and with an enlarged distance [dlaw]. The bodies keep the
    true distance [d] at all times if
        dlaw >= err + loss / A + sqrt ((d + covers + dips)^2 + err^2)    and
        err (1 - A h) <= A h (dlaw - err - loss / A).
    [err]    error of the measured relative position, m: the sum of both errors of position;
    [loss]   by how much the real radial speed of a pair falls short of the law, m/s: slacks and drifts;
    [drift]  error of the velocity of a body, m/s: after [s] it is off by [drift s];
    [dip]    how far a body leaves its straight line between two samples, m; at the samples it is back;
    [cover]  distance of the body from the point that the law steers, m.
    The condition always holds with A h = 1 or err = 0. No speed limit appears. Bodies do not turn, as far as distances
    are concerned: a pair has a convex set [inside], {0} for two points or discs, and its difference of positions keeps
    away from that. *)
Require Import Reals Lra Psatz Lia Safety Convex.
Local Open Scope R_scope.

(** * One period in numbers *)
Section Numbers.

(** [m] is what is kept at the samples. *)
Variables A h m err loss : R.
Hypotheses (h_positive : 0 < h) (A_positive : 0 < A) (no_overshoot : A * h <= 1) (loss_nonneg : 0 <= loss).
Hypotheses (error : 0 <= err < m) (gain : err * (1 - A * h) <= A * h * m).

(** Between the samples a direction that was measured wrongly costs a little, of second order in [err]. *)
Definition floor := sqrt (m * m - err * err).

Lemma floor_bounds : 0 <= floor <= m /\ floor * floor = m * m - err * err.
Proof.
  assert (0 <= m * m - err * err) by nra; unfold floor; split; [split; [apply sqrt_pos |] | apply sqrt_sqrt; lra].
  apply Rsqr_incr_0_var; [unfold Rsqr; rewrite sqrt_sqrt by lra; nra | lra].
Qed.

(** [D] is the measured distance, [q] the true one along the measured direction, [a] their difference. *)
Lemma seen D a q : 0 <= D -> - err <= a -> q = D + a -> m * m <= D * D + 2 * D * a + err * err ->
  floor <= q /\ m - (err + a) * (err / m) <= q.
Proof.
  intros HD Ha Eq Hm; destruct floor_bounds as [[F0 F1] F2].
  assert (Q : 0 <= q) by (apply Rnot_lt_le; intros N; assert (q * q <= a * a) by nra; nra).
  split; [apply Rsqr_incr_0_var; [unfold Rsqr; nra | exact Q] |].
  set (r := err / m); assert (R : err = r * m) by (unfold r; field; lra).
  assert (R1 : 0 <= r <= 1) by (split; apply Rmult_le_reg_r with m; lra).
  apply Rnot_lt_le; intros N; assert (T : 0 <= err + a) by lra; set (t := err + a) in *.
  assert (q * q < (m - t * r) * (m - t * r)) by nra.
  assert ((m - t * r) * (m - t * r) = m * m - 2 * t * err + t * t * (r * r)) by (rewrite R; ring).
  assert (t * t * (r * r) <= t * t) by (assert (r * r <= 1) by nra; assert (0 <= t * t) by nra; nra).
  assert (q * q = D * D + 2 * D * a + a * a) by (rewrite Eq; ring).
  assert (a * a = t * t - 2 * t * err + err * err) by (unfold t; ring); lra.
Qed.

(** What is left after [s], and after the whole period. *)
Lemma after dlaw D a q s : 0 <= D -> - err <= a <= err -> q = D + a -> m * m <= D * D + 2 * D * a + err * err ->
  dlaw = m + err + loss / A -> 0 <= s <= h ->
  floor <= q + s * (bound h A dlaw D - loss) /\ m <= q + h * (bound h A dlaw D - loss).
Proof.
  intros HD Ha Eq Hm Ed Hs; destruct (seen D a q HD (proj1 Ha) Eq Hm) as [Q1 Q2].
  destruct floor_bounds as [F _]; assert (L : loss = A * (loss / A)) by (field; lra); set (g := loss / A) in *.
  assert (G : 0 <= g) by (apply Rmult_le_reg_l with A; lra); assert (As : 0 <= A * s <= A * h) by (split; nra).
  unfold bound; destruct (Rle_dec D dlaw) as [inside | outside].
  - split.
    + replace (q + s * (A * (dlaw - D) - loss)) with ((1 - A * s) * q + A * s * (m + (err + a)))
        by (rewrite Ed, L; replace D with (q - a) by lra; ring).
      assert (floor <= m + (err + a)) by lra; nra.
    + replace (q + h * (A * (dlaw - D) - loss)) with ((1 - A * h) * q + A * h * (m + (err + a)))
        by (rewrite Ed, L; replace D with (q - a) by lra; ring).
      set (t := err + a) in *; assert (T : 0 <= t) by (unfold t; lra); set (r := err / m) in *.
      assert (Er : err = r * m) by (unfold r; field; lra).
      assert (K : (1 - A * h) * r <= A * h) by (apply Rmult_le_reg_r with m; [lra |]; nra).
      assert ((1 - A * h) * (m - t * r) <= (1 - A * h) * q) by (apply Rmult_le_compat_l; lra).
      assert (t * ((1 - A * h) * r) <= t * (A * h)) by (apply Rmult_le_compat_l; lra); lra.
  - assert (S : 0 <= (D - dlaw) * (1 - s / h)).
    { apply Rmult_le_pos; [lra |]; apply Rmult_le_reg_r with h; [lra |]; field_simplify; lra. }
    replace (q + s * (- (D - dlaw) / h - loss)) with (m + (err + a) + g - A * s * g + (D - dlaw) * (1 - s / h))
      by (rewrite L at 1; rewrite Eq, Ed; field; lra).
    replace (q + h * (- (D - dlaw) / h - loss)) with (m + (err + a) + g - A * h * g)
      by (rewrite L at 1; rewrite Eq, Ed; field; lra).
    assert (A * s * g <= g) by nra; assert (A * h * g <= g) by nra; lra.
Qed.

End Numbers.

(** * Any bodies, all times *)
Section Budget.

Variables h A : R.
Hypotheses (h_positive : 0 < h) (A_positive : 0 < A) (no_overshoot : A * h <= 1).
(** At the time [t] the law steers the point [z i t] of body [i], whose centre is at [x i t]; [u i k] is the command of
    sample [k]. *)
Variables (body : Type) (z x : body -> R -> vec) (u : body -> nat -> vec) (drift dip cover : body -> R).
(** Of each pair: whether it is to be kept apart; its convex set; the distance of the law; the error of the measured
    relative position; by how much the commanded radial speed may fall short of the law, and the real one. *)
Variables (apart : body -> body -> Prop) (inside : body -> body -> vec -> Prop).
Variables dlaw err short loss : body -> body -> R.
(** The periods that are spoken of: from the sample [first] on, all or those below some sample. *)
Variables (first : nat) (sampled : nat -> Prop).
Hypothesis from_the_first : forall k, (first <= k)%nat -> sampled (S k) -> sampled k.

Notation sample := (sample h).
Definition relative i j t := sub (z i t) (z j t).
Definition moved i k s := sub (z i (sample k + s)) (z i (sample k)).
(** What is kept at the samples. *)
Definition kept i j := dlaw i j - err i j - loss i j / A.
Definition holds i j m t := clear (inside i j) m (relative i j t).

(** Between the samples, and at the next one. *)
Hypothesis tracks : forall i k s, sampled k -> 0 <= s <= h ->
  norm (sub (moved i k s) (scale s (u i k))) <= drift i * s + dip i.
Hypothesis arrives : forall i k, sampled k -> norm (sub (moved i k h) (scale h (u i k))) <= drift i * h.
Hypothesis covered : forall i k s, sampled k -> 0 <= s <= h ->
  norm (sub (x i (sample k + s)) (z i (sample k + s))) <= cover i.
(** What is computed of a pair before the run. *)
Hypothesis errors : forall i j, apart i j -> 0 <= err i j < kept i j.
Hypothesis gain : forall i j, apart i j -> err i j * (1 - A * h) <= A * h * kept i j.
Hypothesis losses : forall i j, apart i j -> short i j + drift i + drift j <= loss i j /\ 0 <= loss i j.

(** A pair meets the law, evaluated with a measured relative position [w]; or it is so far apart that nothing matters
    before the next sample; or the two do not move in this period. *)
Definition meets i j k := exists w y n,
  norm (sub w (relative i j (sample k))) <= err i j /\ nearest (inside i j) w y n /\
  bound h A (dlaw i j) (norm (sub w y)) - short i j <= dot n (u i k) - dot n (u j k).
Definition far i j k :=
  holds i j (kept i j + (norm (u i k) + drift i + norm (u j k) + drift j) * h) (sample k).
Definition stand i j k := forall s, 0 <= s <= h -> moved i k s = moved j k s.
(** The law is asked for only while the distance is kept, so that [short] may be computed from it. *)
Hypothesis law : forall i j k, sampled k -> apart i j -> holds i j (kept i j) (sample k) ->
  meets i j k \/ far i j k \/ stand i j k.

Lemma drift_nonneg i k : sampled k -> 0 <= drift i.
Proof. intros Hk; pose proof (arrives i k Hk); pose proof (norm_nonneg (sub (moved i k h) (scale h (u i k)))); nra. Qed.

(** One period, in which the two leave their straight lines by at most [(drift i + drift j) s + f]. *)
Lemma between i j k s f : sampled k -> apart i j -> 0 <= s <= h -> holds i j (kept i j) (sample k) -> 0 <= f ->
  norm (sub (moved i k s) (scale s (u i k))) + norm (sub (moved j k s) (scale s (u j k)))
    <= (drift i + drift j) * s + f ->
  holds i j (floor (kept i j) (err i j) - f) (sample k + s) /\
  (s = h -> holds i j (kept i j - f) (sample k + s)).
Proof.
  intros Hk Hij Hs H Hf Off; set (m := kept i j) in *; set (g := relative i j (sample k)).
  destruct (losses i j Hij) as [W L0]; pose proof (errors i j Hij) as E; fold m in E.
  assert (Ed : dlaw i j = m + err i j + loss i j / A) by (unfold m, kept; ring).
  destruct (floor_bounds m (err i j) E) as [FB _].
  set (di := sub (moved i k s) (scale s (u i k))) in *; set (dj := sub (moved j k s) (scale s (u j k))) in *.
  assert (X : relative i j (sample k + s) = add g (add (scale s (sub (u i k) (u j k))) (sub di dj))).
  { unfold g, relative, di, dj, moved; destruct (z i (sample k + s)), (z j (sample k + s)), (z i (sample k)),
      (z j (sample k)), (u i k), (u j k); vectors; f_equal; ring. }
  destruct (law i j k Hk Hij H) as [[w [y [n [Ew [[Hy [[U Xy] B]] M]]]]] | [F | St]].
  - set (D := norm (sub w y)) in *; set (a := dot n (sub g w)); set (q := dot n (sub g y)).
    assert (NN : dot n n = 1) by (rewrite <- norm_square, U; ring).
    assert (Eq : q = D + a).
    { unfold q, a; replace (dot n (sub g y)) with (dot n (sub w y) + dot n (sub g w)) by (vectors; ring).
      rewrite Xy at 1; replace (dot n (scale D n)) with (D * dot n n) by (vectors; ring); rewrite NN; ring. }
    assert (Ha : - err i j <= a <= err i j).
    { pose proof (dot_le n (sub g w)) as C; rewrite U, norm_sym in C; fold g in Ew; unfold a; lra. }
    assert (HD : 0 <= D) by apply norm_nonneg.
    assert (Hm : m * m <= D * D + 2 * D * a + err i j * err i j).
    { pose proof (H y Hy) as Hgy; fold g in Hgy.
      assert (S : dot (sub g y) (sub g y) = D * D + 2 * D * a + dot (sub g w) (sub g w)).
      { replace (dot (sub g y) (sub g y)) with (dot (sub w y) (sub w y) + 2 * dot (sub w y) (sub g w)
          + dot (sub g w) (sub g w)) by (vectors; ring); rewrite <- norm_square; fold D.
        rewrite Xy; unfold a; replace (dot (scale D n) (sub g w)) with (D * dot n (sub g w)) by (vectors; ring); ring. }
      rewrite <- (norm_square (sub g w)) in S; rewrite <- norm_square in S; fold g in Ew; rewrite norm_sym in Ew.
      pose proof (norm_nonneg (sub g w)); pose proof (norm_nonneg (sub g y)); nra. }
    destruct (after A h m (err i j) (loss i j) h_positive A_positive no_overshoot L0 E (gain i j Hij)
      (dlaw i j) D a q s HD Ha Eq Hm Ed Hs) as [P1 P2].
    assert (R : forall c, inside i j c ->
      q + s * (bound h A (dlaw i j) D - loss i j) - f <= norm (sub (relative i j (sample k + s)) c)).
    { intros c Hc; specialize (B c Hc); apply Rle_trans with (2 := unit_dot n _ U); rewrite X.
      replace (dot n (sub (add g (add (scale s (sub (u i k) (u j k))) (sub di dj))) c))
        with (q - dot n (sub c y) + s * (dot n (u i k) - dot n (u j k)) + (dot n di - dot n dj))
        by (unfold q; vectors; ring).
      pose proof (dot_le n di) as Ci; pose proof (dot_le n dj) as Cj; rewrite U in Ci, Cj.
      assert (s * (bound h A (dlaw i j) D - short i j) <= s * (dot n (u i k) - dot n (u j k)))
        by (apply Rmult_le_compat_l; lra).
      assert (s * (short i j + drift i + drift j) <= s * loss i j) by (apply Rmult_le_compat_l; lra); lra. }
    split; [| intros ->]; intros c Hc; specialize (R c Hc); lra.
  - assert (R : forall c, inside i j c -> m - f <= norm (sub (relative i j (sample k + s)) c)).
    { intros c Hc; specialize (F c Hc); fold m g in F; rewrite X.
      set (o := add (scale s (sub (u i k) (u j k))) (sub di dj)).
      pose proof (nearly (sub (add g o) c) (sub g c)) as T.
      replace (sub (sub (add g o) c) (sub g c)) with o in T by (destruct g, o, c; vectors; f_equal; ring).
      assert (O : norm o <= s * (norm (u i k) + norm (u j k)) + norm di + norm dj).
      { pose proof (triangle (scale s (sub (u i k) (u j k))) (sub di dj)) as T1; rewrite norm_scale in T1 by lra.
        pose proof (norm_difference (u i k) (u j k)); pose proof (norm_difference di dj); fold o in T1; nra. }
      pose proof (norm_nonneg (u i k)); pose proof (norm_nonneg (u j k)).
      pose proof (drift_nonneg i k Hk); pose proof (drift_nonneg j k Hk).
      set (v := norm (u i k) + drift i + norm (u j k) + drift j) in *.
      assert (v * s <= v * h) by (apply Rmult_le_compat_l; unfold v; lra); unfold v in *; lra. }
    split; [| intros _]; intros c Hc; specialize (R c Hc); lra.
  - specialize (St s Hs); assert (E0 : relative i j (sample k + s) = g).
    { unfold moved in St; unfold g, relative; destruct (z i (sample k + s)), (z j (sample k + s)), (z i (sample k)),
        (z j (sample k)); unfold sub in *; simpl in *; injection St; intros; f_equal; lra. }
    split; [| intros _]; intros c Hc; rewrite E0; specialize (H c Hc); fold g in H; lra.
Qed.

(** THEOREM (7)-(8), (11): At every sample the points that the law steers keep its distance d_law, but for eps and W/A.
    - The product of gain and control period, A h, is at most 1: min(A h, 1) stands for it (Safety.capped).
    - At every sample the pair meets the law, up to a slack, with a relative position that is measured up to eps; or it
      is too far apart to come below d_law - eps - W/A before the next sample, or stands.
    - W is at least the slacks and drifts of the two; dips and covers are what the plants have at most (Mixed).
    - eps (1 - A h) <= A h (d_law - eps - W/A), and eps is below d_law - eps - W/A.
    - The pair starts at d_law - eps - W/A or farther (Budget.measured_start).
    Silent on: How fast a pair that starts nearer recovers: that is Safety.recovers. *)
Theorem at_samples i j : apart i j -> holds i j (kept i j) (sample first) ->
  forall k, (first <= k)%nat -> sampled k -> holds i j (kept i j) (sample k).
Proof.
  intros Hij H0 k F; induction F as [| k F IH]; intros Hk; [exact H0 |].
  apply from_the_first in Hk; [| exact F]; rewrite next.
  destruct (between i j k h 0 Hk Hij ltac:(lra) (IH Hk) (Rle_refl 0)) as [_ P].
  { pose proof (arrives i k Hk); pose proof (arrives j k Hk); lra. }
  intros c Hc; specialize (P eq_refl c Hc); lra.
Qed.

(** ** Between the samples they lose their dips as well, and what a wrong direction costs. *)
Theorem always i j : apart i j -> holds i j (kept i j) (sample first) ->
  forall k s, (first <= k)%nat -> sampled k -> 0 <= s <= h ->
  holds i j (floor (kept i j) (err i j) - dip i - dip j) (sample k + s).
Proof.
  intros Hij H0 k s F Hk Hs; assert (Dip : forall b, 0 <= dip b).
  { intros b; pose proof (tracks b k 0 Hk ltac:(lra)) as T.
    pose proof (norm_nonneg (sub (moved b k 0) (scale 0 (u b k)))); lra. }
  destruct (between i j k s (dip i + dip j) Hk Hij Hs (at_samples i j Hij H0 k F Hk)) as [P _].
  - pose proof (Dip i); pose proof (Dip j); lra.
  - pose proof (tracks i k s Hk Hs); pose proof (tracks j k s Hk Hs); lra.
  - intros c Hc; specialize (P c Hc); lra.
Qed.

(** The least distance of the law for [d] between the bodies. *)
Definition needed i j d :=
  err i j + loss i j / A + sqrt ((d + cover i + cover j + dip i + dip j) ^ 2 + err i j ^ 2).

(** ** The budget: the bodies keep [d] in all periods that there are. *)
Theorem budget i j d : apart i j -> 0 <= d + cover i + cover j + dip i + dip j -> needed i j d <= dlaw i j ->
  holds i j (kept i j) (sample first) -> forall k s, (first <= k)%nat -> sampled k -> 0 <= s <= h ->
  clear (inside i j) d (sub (x i (sample k + s)) (x j (sample k + s))).
Proof.
  intros Hij Hd Hn H0 k s F Hk Hs c Hc; pose proof (always i j Hij H0 k s F Hk Hs c Hc) as P.
  pose proof (covered i k s Hk Hs) as Ci; pose proof (covered j k s Hk Hs) as Cj; set (t := sample k + s) in *.
  pose proof (errors i j Hij) as E.
  destruct (floor_bounds (kept i j) (err i j) E) as [F0 F2].
  set (b := d + cover i + cover j + dip i + dip j) in *; assert (B : b <= floor (kept i j) (err i j)).
  { apply Rsqr_incr_0_var; [| lra]; unfold Rsqr; rewrite F2; assert (K : sqrt (b ^ 2 + err i j ^ 2) <= kept i j)
      by (unfold needed in Hn; fold b in Hn; unfold kept; lra).
    assert (S : 0 <= b ^ 2 + err i j ^ 2) by nra; pose proof (sqrt_pos (b ^ 2 + err i j ^ 2)).
    pose proof (sqrt_sqrt _ S); nra. }
  set (o := sub (sub (x i t) (z i t)) (sub (x j t) (z j t))).
  pose proof (nearly (sub (sub (x i t) (x j t)) c) (sub (relative i j t) c)) as N.
  replace (sub (sub (sub (x i t) (x j t)) c) (sub (relative i j t) c)) with o in N
    by (unfold o, relative; destruct (x i t), (x j t), (z i t), (z j t), c; vectors; f_equal; ring).
  assert (norm o <= cover i + cover j).
  { pose proof (triangle (sub (x i t) (z i t)) (sub (z j t) (x j t))) as Q; rewrite (norm_sym (z j t)) in Q.
    replace (add (sub (x i t) (z i t)) (sub (z j t) (x j t))) with o in Q
      by (unfold o; destruct (x i t), (x j t), (z i t), (z j t); vectors; f_equal; ring); lra. }
  unfold b in B; lra.
Qed.

(** THEOREM (7)-(8), (11): Pairs that meet the law, as measured and with the distance d_law, keep the true distance d at
    all times.
    - The hypotheses of Budget.at_samples.
    - d_law is at least eps + W/A + sqrt((d + covers + dips)^2 + eps^2).
    Silent on: Anything about sets that turn, or about a pair from a period on in which it misses the law by more than
    W. *)
Corollary budget_always i j d : first = 0%nat -> (forall k, sampled k) -> apart i j ->
  0 <= d + cover i + cover j + dip i + dip j -> needed i j d <= dlaw i j -> holds i j (kept i j) 0 ->
  forall t, 0 <= t -> clear (inside i j) d (sub (x i t) (x j t)).
Proof.
  intros F Hk Hij Hd Hn H0 t Ht; destruct (periods h h_positive t Ht) as [k [s [Hs ->]]]; apply budget; auto.
  - rewrite F; unfold Safety.sample; simpl; rewrite Rmult_0_l; exact H0.
  - lia.
Qed.

(** THEOREM: A pair that is measured to be at d_law at the start has the distance from which the budget begins.
    - Its relative position is measured with an error of eps at most. *)
Lemma measured_start i j w t : apart i j -> norm (sub w (relative i j t)) <= err i j ->
  clear (inside i j) (dlaw i j) w ->
  holds i j (kept i j) t.
Proof.
  intros Hij Ew Hw c Hc; specialize (Hw c Hc); pose proof (nearly (sub (relative i j t) c) (sub w c)) as N.
  replace (sub (sub (relative i j t) c) (sub w c)) with (sub (relative i j t) w) in N
    by (destruct (relative i j t), w, c; vectors; f_equal; ring); rewrite (norm_sym (relative i j t) w) in N.
  destruct (losses i j Hij) as [_ L]; assert (0 <= loss i j / A) by (apply Rle_mult_inv_pos; lra); unfold kept; lra.
Qed.

End Budget.

(** * Who does which part of the law *)

(** Both of a pair take a share and may miss it by a slack. An obstacle takes none. Beside one that moves at [Vo] at
    most the robot moves away at [bound + Vo]: its slack is [- Vo]. The obstacle has the command 0 and the drift [Vo].
    *)
Lemma halves B q q' e e' a b : q + q' = 1 -> q * B - e <= a -> q' * B - e' <= - b -> B - (e + e') <= a - b.
Proof. intros Q Ha Hb; replace q with (1 - q') in Ha by lra; lra. Qed.

(** THEOREM: What meets the law with a gain meets it with a smaller one.
    - The period is positive. *)
Lemma smaller_gain h A A' d D : A' <= A -> bound h A' d D <= bound h A d D.
Proof. intros HA; unfold bound; destruct (Rle_dec D d); [apply Rmult_le_compat_r; lra | lra]. Qed.

(** So does a pair of which both do their halves ([smaller_gain]). *)
(** THEOREM: Where one of two robots stands and the other does its half with a gain, they meet the law with half of it.
    - The period is positive. *)
Lemma one_stands h A d D b : 0 < h -> bound h A d D / 2 <= b -> bound h (A / 2) d D <= b.
Proof.
  intros Hh M; apply Rle_trans with (2 := M); unfold bound; destruct (Rle_dec D d) as [| out]; [lra |].
  assert (I : 0 < / h) by (apply Rinv_0_lt_compat; lra); unfold Rdiv; nra.
Qed.

(** Two directions differ by no more than twice the difference of the places that they lead to, over both distances. *)
Lemma directions D D' n n' : 0 <= D -> 0 <= D' -> norm n = 1 -> norm n' = 1 ->
  norm (sub n n') * (D + D') <= 2 * norm (sub (scale D n) (scale D' n')).
Proof.
  intros H H' U U'; pose proof (norm_nonneg (sub n n')); pose proof (norm_nonneg (sub (scale D n) (scale D' n'))).
  pose proof (norm_square n) as N; pose proof (norm_square n') as N'; rewrite U in N; rewrite U' in N'.
  pose proof (dot_le n n') as C; rewrite U, U' in C; set (c := dot n n') in *.
  apply Rsqr_incr_0_var; [| lra]; unfold Rsqr.
  replace (norm (sub n n') * (D + D') * (norm (sub n n') * (D + D')))
    with (norm (sub n n') * norm (sub n n') * ((D + D') * (D + D'))) by ring.
  replace (2 * norm (sub (scale D n) (scale D' n')) * (2 * norm (sub (scale D n) (scale D' n'))))
    with (4 * (norm (sub (scale D n) (scale D' n')) * norm (sub (scale D n) (scale D' n')))) by ring.
  rewrite !norm_square.
  replace (dot (sub n n') (sub n n')) with (dot n n + dot n' n' - 2 * c) by (unfold c; destruct n, n'; vectors; ring).
  replace (dot (sub (scale D n) (scale D' n')) (sub (scale D n) (scale D' n')))
    with (D * D * dot n n + D' * D' * dot n' n' - 2 * D * D' * c) by (unfold c; destruct n, n'; vectors; ring).
  rewrite <- N, <- N'; pose proof (Rle_0_sqr (D - D')) as S; unfold Rsqr in S.
  assert (T : 0 <= (1 + c) * ((D - D') * (D - D'))) by (apply Rmult_le_pos; lra); lra.
Qed.

(** THEOREM: If two robots measure each other, both do their share of the law along the direction that one of them sees,
    but for a slack of 2 V e / (D + D').
    - The robot whose slack this is sees a distance D' that is not larger, and is no faster than V.
    - Their measurements of the pair differ by e at most. *)
Lemma own_views h A d q D D' n n' u V e : 0 < h -> 0 <= A -> 0 <= q -> 0 < D -> 0 <= D' <= D -> norm n = 1 ->
  norm n' = 1 -> norm u <= V -> norm (sub (scale D n) (scale D' n')) <= e -> q * bound h A d D' <= - dot n' u ->
  q * bound h A d D - 2 * V * e / (D + D') <= - dot n u.
Proof.
  intros Hh HA Hq HD HD' U U' HV E M; pose proof (directions D D' n n' (Rlt_le _ _ HD) (proj1 HD') U U') as X.
  assert (B : bound h A d D <= bound h A d D').
  { assert (I : 0 < / h) by (apply Rinv_0_lt_compat; lra); unfold bound, Rdiv.
    destruct (Rle_dec D d) as [a | a]; destruct (Rle_dec D' d) as [b | b]; try lra.
    - apply Rmult_le_compat_l; lra.
    - apply Rle_trans with 0; [nra | apply Rmult_le_pos; lra].
    - apply Rmult_le_compat_r; lra. }
  assert (q * bound h A d D <= q * bound h A d D') by (apply Rmult_le_compat_l; lra).
  pose proof (dot_le (sub n n') u) as C; pose proof (norm_nonneg u); pose proof (norm_nonneg (sub n n')).
  replace (dot (sub n n') u) with (dot n u - dot n' u) in C by (destruct n, n', u; vectors; ring).
  assert (Y : norm (sub n n') * norm u <= 2 * V * e / (D + D')).
  { apply Rmult_le_reg_r with (D + D'); [lra |]; replace (2 * V * e / (D + D') * (D + D')) with (2 * V * e) by (field; lra).
    apply Rle_trans with (V * (norm (sub n n') * (D + D'))); [| apply Rle_trans with (V * (2 * e)); [| lra]].
    - replace (norm (sub n n') * norm u * (D + D')) with (norm u * (norm (sub n n') * (D + D'))) by ring.
      apply Rmult_le_compat_r; [apply Rmult_le_pos |]; lra.
    - apply Rmult_le_compat_l; lra. }
  lra.
Qed.
