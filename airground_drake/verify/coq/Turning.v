(** Chord steering of a unicycle that turns at [W] at most, with any hand point [l] > 0: the command is shortened.

    [(a, b)] is the command in the body frame, T = tan (W h / 2). Where [h (|b| - a T) > 2 l T] it is multiplied by
        2 l T / (h (|b| - a T)) < 1.
    Proved: |omega| <= W; the hand point arrives exactly where the *shortened* command leads; every inequality
    [bound <= n.u] with [bound <= 0] stays met, and so does the law of Passive.v, but for its retreat. Where the law asks
    for a recovery, [bound > 0], the shortened command meets it with a smaller gain: [shortened_gain]. *)
Require Import Reals Lra Psatz Safety Plants Pieces Passive.
Local Open Scope R_scope.

Definition factor l h T a b :=
  if Rle_dec (h * (Rabs b - a * T)) (2 * l * T) then 1 else 2 * l * T / (h * (Rabs b - a * T)).

Section Turning.

Variables l h W a b : R.
Hypotheses (l_positive : 0 < l) (h_positive : 0 < h) (W_positive : 0 < W) (less_than_half : W * h < PI).
Let T := tan (W * h / 2).
Let s := factor l h T a b.

Lemma T_positive : 0 < T.
Proof. apply tan_gt_0; [apply Rmult_lt_0_compat; nra | lra]. Qed.

Lemma factor_bounds : 0 < s <= 1 /\ s * (h * (Rabs b - a * T)) <= 2 * l * T.
Proof.
  pose proof T_positive as P; assert (Q : 0 < 2 * l * T) by (apply Rmult_lt_0_compat; lra); unfold s, factor.
  destruct (Rle_dec (h * (Rabs b - a * T)) (2 * l * T)) as [H | H]; [lra |]; set (g := h * (Rabs b - a * T)) in *.
  assert (E : 2 * l * T / g * g = 2 * l * T) by (field; lra); split; [split |]; [apply Rdiv_lt_0_compat; lra | | lra].
  apply Rmult_le_reg_r with g; lra.
Qed.

(** Chord steering can follow the shortened command. *)
Lemma ahead_of_axle : b <> 0 -> 0 < 2 * l + s * a * h.
Proof.
  intros B; destruct factor_bounds as [S F]; pose proof T_positive as P; pose proof (Rabs_pos_lt b B) as Q.
  assert (0 < s * h * Rabs b) by (apply Rmult_lt_0_compat; [nra | exact Q]).
  apply Rmult_lt_reg_r with T; [exact P |]; rewrite Rmult_0_l; lra.
Qed.

Lemma turns_within : Rabs (2 * atan (s * b * h / (2 * l + s * a * h)) / h) <= W.
Proof.
  assert (P : - (W * h / 2) <= atan (s * b * h / (2 * l + s * a * h)) <= W * h / 2).
  { assert (0 < W * h) by nra; destruct (Req_dec b 0) as [B | B].
    - rewrite B; replace (s * 0 * h / (2 * l + s * a * h)) with 0 by (unfold Rdiv; ring); rewrite atan_0; lra.
    - pose proof (ahead_of_axle B) as Ah; destruct factor_bounds as [S F]; pose proof T_positive as P.
      set (y := 2 * l + s * a * h) in *; set (x := s * b * h / y); assert (X : x * y = s * b * h) by (unfold x; field;
        lra).
      assert (G : Rabs (s * b * h) <= T * y) by (rewrite !Rabs_mult, (Rabs_right s), (Rabs_right h) by lra; unfold y;
        lra).
      assert (- T <= x <= T).
      { assert (- (T * y) <= s * b * h <= T * y) by (revert G; unfold Rabs; destruct Rcase_abs; lra).
        split; apply Rmult_le_reg_r with y; lra. }
      assert (At : atan T = W * h / 2) by (apply atan_tan; lra).
      assert (M : forall p q, p <= q -> atan p <= atan q)
        by (intros p q [L | ->]; [left; apply atan_increasing, L | lra]).
      split; [rewrite <- At, <- atan_opp |]; [| rewrite <- At]; apply M; lra. }
  replace (2 * atan (s * b * h / (2 * l + s * a * h)) / h) with (atan (s * b * h / (2 * l + s * a * h)) * (2 / h)) by
    (field; lra).
  set (x := atan (s * b * h / (2 * l + s * a * h))) in *; assert (I : 0 < 2 / h) by (apply Rdiv_lt_0_compat; lra).
  rewrite Rabs_mult, (Rabs_right (2 / h)) by lra; replace W with (W * h / 2 * (2 / h)) by (field; lra).
  apply Rmult_le_compat_r; [lra |]; unfold Rabs; destruct Rcase_abs; lra.
Qed.

Lemma turn_scale r th : turn th (r * a) (r * b) = scale r (turn th a b).
Proof. unfold turn, scale; simpl; f_equal; ring. Qed.

(** THEOREM: A command that is shortened as far as the turning limit asks for is followed exactly, within the limit.
    - The hand point is ahead of the axle.
    - The limit is less than half a turn per period.
    - Speed and turning rate are those of chord steering, and constant in a period.
    - Positions do not jump, and have the plant's derivatives inside the periods.
    Silent on: Limits of wheel speeds: those shorten a command further. *)
Theorem shortened_chord p th om v : chord_steering l h (s * a) (s * b) om v ->
  goes p (fun r => turn (th + om * r) v (l * om)) h ->
  Rabs om <= W /\ sub (p h) (p 0) = scale h (scale s (turn th a b)) /\
  forall r, 0 <= r <= h ->
    norm (sub (sub (p r) (p 0)) (scale r (scale s (turn th a b)))) <= Rabs om * speed v (l * om) * (h * h) / 8.
Proof.
  intros C G; destruct (chord p th om v l h (s * a) (s * b) h_positive C G) as [A D].
  rewrite !turn_scale in *; split; [| split; assumption]; destruct C as [_ [-> _]].
  exact turns_within.
Qed.

(** THEOREM: There is a chord steering for every command that was shortened like that.
    - The hand point is ahead of the axle.
    - The limit is less than half a turn per period. *)
Theorem steering_exists : exists om v, chord_steering l h (s * a) (s * b) om v.
Proof.
  set (be := atan (s * b * h / (2 * l + s * a * h))).
  exists (2 * be / h); destruct (Req_dec be 0) as [B | B].
  - exists (s * a); split; [| split; [reflexivity | split; [| reflexivity]]].
    + intros Sb; apply ahead_of_axle; intros Z; apply Sb; rewrite Z; ring.
    + fold be; rewrite B, sin_0; ring.
  - assert (b <> 0).
    { intros Z; apply B; unfold be; rewrite Z; replace (s * 0 * h / (2 * l + s * a * h)) with 0 by (unfold Rdiv;
      ring); apply atan_0. }
    exists ((s * a * cos be + s * b * sin be) * be / sin be); split; [intros _; apply ahead_of_axle; assumption |].
    split; [reflexivity |]; fold be; split.
    + field; intros Z; destruct (atan_bound (s * b * h / (2 * l + s * a * h))) as [B1 B2]; fold be in B1, B2.
      destruct (Rtotal_order be 0) as [L | [L | L]]; [| exact (B L) |].
      * pose proof (sin_lt_0_var be ltac:(lra) L); lra.
      * pose proof (sin_gt_0 be L ltac:(lra)); lra.
    + intros Z; destruct factor_bounds as [S _]; apply Rmult_integral in Z; destruct Z; lra.
Qed.

End Turning.

(** THEOREM: A limit of half a turn per period or more never binds.
    - The period is positive. *)
Lemma no_limit h W x : 0 < h -> PI <= W * h -> Rabs (2 * atan x / h) <= W.
Proof.
  intros Hh HW; replace (2 * atan x / h) with (atan x * (2 / h)) by (field; lra).
  assert (I : 0 < 2 / h) by (apply Rdiv_lt_0_compat; lra); rewrite Rabs_mult, (Rabs_right (2 / h)) by lra.
  apply Rle_trans with (PI / 2 * (2 / h)).
  - apply Rmult_le_compat_r; [lra |]; destruct (atan_bound x); unfold Rabs; destruct Rcase_abs; lra.
  - replace (PI / 2 * (2 / h)) with (PI / h) by (field; lra); apply Rmult_le_reg_r with h; [lra |].
    replace (PI / h * h) with PI by (field; lra); exact HW.
Qed.

(** ** A hand point at [l >= V0 h / (2 sin (W h / 2))] never needs a shortened command at the speed [V0]. *)
(** THEOREM: At speeds up to V chord steering turns at (2/h) asin(V h/(2 l)) at most.
    - V h is at most 2 l.
    - 2 l + a h is positive, a the command ahead. *)
Theorem chord_turns l h a b V0 : 0 < l -> 0 < h -> 0 < 2 * l + a * h -> speed a b <= V0 -> V0 * h <= 2 * l ->
  Rabs (2 * atan (b * h / (2 * l + a * h)) / h) <= 2 / h * asin (V0 * h / (2 * l)).
Proof.
  intros Hl Hh Ah HV HL; set (be := atan (b * h / (2 * l + a * h))).
  destruct (atan_bound (b * h / (2 * l + a * h))) as [B1 B2]; fold be in B1, B2.
  assert (Sp : 0 <= speed a b) by apply sqrt_pos.
  assert (C : 0 < cos be) by (apply cos_gt_0; lra).
  assert (Tt : (2 * l + a * h) * sin be = b * h * cos be).
  { assert (Q : tan be = b * h / (2 * l + a * h)) by apply tan_atan; unfold tan in Q.
    replace (sin be) with (sin be / cos be * cos be) by (field; lra); rewrite Q; field; lra. }
  assert (E : 2 * l * sin be = h * (b * cos be - a * sin be)) by lra.
  assert (F : (b * cos be - a * sin be) * (b * cos be - a * sin be) <= speed a b * speed a b).
  { unfold speed; rewrite sqrt_sqrt by nra; pose proof (sin2_cos2 be) as SC; unfold Rsqr in SC.
    pose proof (Rle_0_sqr (a * cos be + b * sin be)) as Q; unfold Rsqr in Q.
    assert ((a * a + b * b) * (sin be * sin be + cos be * cos be) = a * a + b * b) by (rewrite SC; ring); nra. }
  set (x := V0 * h / (2 * l)); assert (X : x * (2 * l) = V0 * h) by (unfold x; field; lra).
  assert (G : - (V0) <= b * cos be - a * sin be <= V0) by (split; nra).
  assert (S : - x <= sin be <= x) by (split; apply Rmult_le_reg_r with (2 * l); nra).
  assert (X1 : -1 <= x <= 1) by (split; apply Rmult_le_reg_r with (2 * l); nra).
  assert (R : - asin x <= be <= asin x).
  { destruct (asin_bound x) as [A1 A2]; split.
    - apply Rnot_lt_le; intros L; assert (sin be < sin (- asin x)) by (apply sin_increasing_1; lra).
      rewrite sin_neg, sin_asin in *; lra.
    - apply Rnot_lt_le; intros L; assert (sin (asin x) < sin be) by (apply sin_increasing_1; lra);
      rewrite sin_asin in *; lra. }
  replace (2 * be / h) with (be * (2 / h)) by (field; lra); assert (I : 0 < 2 / h) by (apply Rdiv_lt_0_compat; lra).
  rewrite Rabs_mult, (Rabs_right (2 / h)) by lra; rewrite Rmult_comm; apply Rmult_le_compat_l; [lra |].
  unfold Rabs; destruct Rcase_abs; lra.
Qed.

(** Its front wheels steer. In the cone [rho |omega| <= v]: it never drives backwards, and cannot turn on the spot. *)
(** THEOREM: With chord steering a car follows every command of the cone R |b| <= l a at a radius of R at least.
    - The hand point is ahead of the axle.
    - The command leads ahead: a is not negative.
    - Speed and turning rate are those of chord steering, and constant in a period.
    Silent on: That a car gets anywhere: it stands where no command of the cone is allowed. *)
Theorem car l h a b om v rho : 0 < l -> 0 < h -> 0 <= a -> 0 <= rho -> rho * Rabs b <= l * a ->
  chord_steering l h a b om v -> rho * Rabs om <= v.
Proof.
  intros Hl Hh Ha Hr Cone C; destruct (Req_dec b 0) as [B | B].
  { subst b; destruct (straight l h a om v Hh C) as [-> ->]; rewrite Rabs_R0; lra. }
  destruct C as [_ [Om [V _]]]; set (be := atan (b * h / (2 * l + a * h))) in *.
  destruct (atan_bound (b * h / (2 * l + a * h))) as [B1 B2]; fold be in B1, B2.
  assert (P : 0 < cos be) by (apply cos_gt_0; lra); assert (Y : 0 < 2 * l + a * h) by nra.
  assert (T : (2 * l + a * h) * sin be = b * h * cos be).
  { assert (Q : tan be = b * h / (2 * l + a * h)) by apply tan_atan; unfold tan in Q.
    replace (sin be) with (sin be / cos be * cos be) by (field; lra); rewrite Q; field; lra. }
  set (y := 2 * l + a * h) in *; set (w := Rabs b) in *.
  assert (E : 2 * rho * w <= a * y + b * b * h) by (unfold y; nra).
  assert (G : forall be' s', 0 < be' -> 0 < s' -> Rabs om = 2 * be' / h -> y * s' = w * h * cos be ->
    v * s' * y = be' * (cos be * (a * y + b * b * h)) -> rho * Rabs om <= v).
  { intros be' s' Bp Sp -> T' V'; apply Rmult_le_reg_r with (s' * y); [nra |].
    replace (rho * (2 * be' / h) * (s' * y)) with (rho * (2 * be' / h) * (y * s')) by ring; rewrite T'.
    replace (rho * (2 * be' / h) * (w * h * cos be)) with (be' * (cos be * (2 * rho * w))) by (field; lra).
    replace (v * (s' * y)) with (v * s' * y) by ring; rewrite V'.
    apply Rmult_le_compat_l; [lra |]; apply Rmult_le_compat_l; lra. }
  assert (V1 : v * sin be * y = be * (cos be * (a * y + b * b * h))).
  { replace (v * sin be * y) with ((a * cos be + b * sin be) * be * y) by (rewrite <- V; ring).
    replace ((a * cos be + b * sin be) * be * y) with (be * (a * cos be * y + b * (y * sin be))) by ring.
    rewrite T; ring. }
  destruct (Rtotal_order b 0) as [L | [Z | L]]; [| contradiction |].
  - assert (be < 0).
    { unfold be; rewrite <- atan_0; apply atan_increasing; unfold y in *; apply Rmult_lt_reg_r with (2 * l + a * h);
      [exact Y |]; replace (b * h / (2 * l + a * h) * (2 * l + a * h)) with (b * h) by (field; lra); nra. }
    assert (W : w = - b) by (unfold w; apply Rabs_left; exact L).
    apply (G (- be) (- sin be)); [lra | pose proof (sin_lt_0_var be ltac:(lra) H); lra | | rewrite W; lra | lra].
    rewrite Om, Rabs_left; [field; lra |]; replace (2 * be / h) with (be * (2 / h)) by (field; lra).
    assert (0 < 2 / h) by (apply Rdiv_lt_0_compat; lra); nra.
  - assert (0 < be).
    { unfold be; rewrite <- atan_0; apply atan_increasing; unfold y in *; apply Rdiv_lt_0_compat; nra. }
    assert (W : w = b) by (unfold w; apply Rabs_right; lra).
    apply (G be (sin be)); [lra | apply sin_gt_0; lra | | rewrite W; lra | lra].
    rewrite Om; apply Rabs_right; apply Rle_ge; left; apply Rdiv_lt_0_compat; lra.
Qed.

(** * What a shortened command still meets *)
Section Shortened.

Variables (s : R) (u : vec).
Hypothesis s_bounds : 0 < s <= 1.

(** THEOREM: A shortened command still meets every inequality that v = 0 meets.
    - The share that is left is above 0 and at most 1. *)
Theorem shortened n bd : bd <= 0 -> bd <= dot n u -> bd <= dot n (scale s u).
Proof. intros Hb H; replace (dot n (scale s u)) with (s * dot n u) by (vectors; ring); nra. Qed.

(** The pair takes the smaller gain of its two robots ([smaller_gain] in Budget.v). *)
(** THEOREM: Inside the distance of the law a command shortened to the share s meets the law with the gain s A.
    - The share that is left is above 0 and at most 1. *)
Theorem shortened_gain h A d D q n : 0 < h -> 0 <= A -> 0 <= q -> q * bound h A d D <= dot n u ->
  q * bound h (s * A) d D <= dot n (scale s u).
Proof.
  intros Hh HA Hq H; replace (dot n (scale s u)) with (s * dot n u) by (vectors; ring).
  apply Rle_trans with (s * (q * bound h A d D)); [| apply Rmult_le_compat_l; lra].
  unfold bound; destruct (Rle_dec D d) as [L | L]; [right; ring |].
  assert (B : - (D - d) / h <= 0) by (assert (0 <= (D - d) / h) by (apply Rle_mult_inv_pos; lra); unfold Rdiv in *;
    lra).
  replace (s * (q * (- (D - d) / h))) with (q * (s * (- (D - d) / h))) by ring; apply Rmult_le_compat_l; nra.
Qed.

(** ** Beside an obstacle that moves the law stays met, but for the retreat. A retreat at [r] that the law asks for in
    full becomes one at [s r]. *)
(** THEOREM: Beside an obstacle that moves a shortened command still obeys, and a retreat at r becomes one at s r.
    - The share that is left is above 0 and at most 1.
    Silent on: A retreat that was not asked for in full: of that only r = 0 is left. *)
Theorem shortened_obeys h L gap r x : obeys h L gap r x u ->
  obeys h L gap 0 x (scale s u) /\ (r <= (L - gap x) / h -> obeys h L gap (s * r) x (scale s u)).
Proof.
  intros [R0 [n [N M]]]; set (b := (L - gap x) / h) in *.
  assert (E : dot n (scale s u) = s * dot n u) by (vectors; ring).
  split; [| intros Hr]; (split; [nra |]); exists n; (split; [exact N |]); rewrite E; fold b.
  - assert (s * Rmin r b <= s * dot n u) by (apply Rmult_le_compat_l; lra).
    revert H; unfold Rmin; destruct (Rle_dec r b), (Rle_dec 0 b); nra.
  - rewrite Rmin_left in M by exact Hr; apply Rle_trans with (1 := Rmin_l _ _); apply Rmult_le_compat_l; lra.
Qed.

End Shortened.
