(** Entries of a run's table (Mixed.v), for pairs of points: decided exactly, from the recorded positions. *)
Require Import Reals Lra Psatz ZArith List Bool Lia.
Require Import Safety Convex Run Mixed.
Local Open Scope Z_scope.

(** * What is computed: a step of the run is a period, [num / den] stands for A h. Lengths are in parts. *)

(** [bound d D - e <= x . v / D], [D] the norm of [x]. With [w := den (x . v) + c D^2] and [m := c d - den e], where [c]
    is [num] inside the safe distance and [den] outside, it is [m D <= w]; without the root, [m^2 D^2 <= w^2]. *)
Definition meets_law (num den d e : Z) (x v : point) :=
  let D2 := product x x in
  let c := if D2 <=? d * d then num else den in
  let w := den * product x v + c * D2 in
  let m := c * d - den * e in
  if 0 <? D2 then if 0 <=? w then if m <=? 0 then true else m * m * D2 <=? w * w else false else false.

Definition step_meets (num den d e reach : Z) (p p' q q' : point) :=
  let x := minus p q in
  if is_far (d + reach) x then true else meets_law num den d e x (minus (minus p' p) (minus q' q)).

(** At its first row the pair lacks at most [e / gain] of its safe distance. *)
Definition starts_within (num den d e : Z) (p q : point) :=
  let m := num * d - den * e in
  if m <=? 0 then true else let x := minus p q in m * m <=? num * num * product x x.

Definition row (b : track) k := nth k (places b) (P 0 0 0).

(** Bodies [i] and [j], distance of the law [a / b] metres (a whole number of parts), error [e] parts a step; [N] steps
    from the row [K] on. *)
Definition obeys_law (r : run) (i j : nat) (num den a b e : Z) (K N : nat) :=
  let u := track_of r i in let v := track_of r j in let d := a * unit r / b in
  if 0 <? b then if d * b =? a * unit r then if 0 <? num then if num <=? den then if 0 <=? d then if 0 <=? e then
  if (0 <? N)%nat then if (K + N <? length (times r))%nat then if has_rows r i then if has_rows r j then
  if starts_within num den d e (row u K) (row v K) then
  some_steps (step_meets num den d e (stride u + stride v)) N (skipn K (places u)) (skipn K (places v))
  else false else false else false else false else false else false else false else false else false else false
  else false.

(** * What it means *)
Local Open Scope R_scope.

(** Where body [i] is recorded at the row [k], m, and its step from there. Time is in steps. *)
Definition row_at (r : run) i k := place_in r (row (track_of r i) k).
Definition step_of (r : run) i k := sub (row_at r i (S k)) (row_at r i k).

(** The record is that of the point that the law steers. Between two rows it leaves its straight line by its dip, and
    the body stays within its cover. *)
Definition as_recorded (r : run) i b := drift b = 0 /\ 0 <= dip b /\ (forall k, command b k = step_of r i k) /\
  forall k s, (S k < length (times r))%nat -> 0 <= s <= 1 ->
    let off := sub (sub (steered b (INR k + s)) (row_at r i k)) (scale s (step_of r i k)) in
    norm off <= dip b /\ (s = 0 \/ s = 1 -> norm off <= 0) /\
    norm (sub (place b (INR k + s)) (steered b (INR k + s))) <= cover b.

Lemma recorded_at r i b k : as_recorded r i b -> (S k < length (times r))%nat -> steered b (INR k) = row_at r i k.
Proof.
  intros [_ [_ [_ H]]] K; destruct (H k 0 K ltac:(lra)) as [_ [Z _]]; specialize (Z ltac:(auto)).
  rewrite Rplus_0_r in Z; apply norm_zero; eapply Rle_trans; [| exact Z]; right; f_equal; apply vec_eq; vectors; ring.
Qed.

Lemma recorded_conforms r i b k : as_recorded r i b -> (S k < length (times r))%nat -> conforms 1 b k.
Proof.
  intros B K s Hs; pose proof (recorded_at r i b k B K) as A; destruct B as [D [P [C H]]].
  destruct (H k s K Hs) as [T [Z Co]]; unfold sample; rewrite Rmult_1_r, A, C, D; cbv zeta.
  split; [lra | split; [intros -> | exact Co]]; specialize (Z ltac:(auto)); lra.
Qed.

(** ** First order: a body that moves on the straight lines between the recorded positions. *)
Definition straight (r : run) i := let rows := seq 0 (length (times r)) in
  let p := path (map INR rows) (map (row_at r i) rows) in Body p p (step_of r i) 0 0 0.

Lemma nth_row (A : Type) (f : nat -> A) n k o : (k < n)%nat -> nth k (map f (seq 0 n)) o = f k.
Proof.
  intros H; rewrite nth_indep with (d' := f 0%nat) by (rewrite map_length, seq_length; exact H).
  rewrite map_nth, seq_nth by exact H; reflexivity.
Qed.

Lemma increasing_rows n : forall a, increasing (map INR (seq a n)).
Proof.
  induction n as [| [| n] IH]; intros a; [exact I | exact I |]; specialize (IH (S a)); split; [| exact IH].
  rewrite S_INR; lra.
Qed.

Lemma straight_at r i k s : (S k < length (times r))%nat -> 0 <= s <= 1 ->
  steered (straight r i) (INR k + s) = add (row_at r i k) (scale s (step_of r i k)).
Proof.
  intros K Hs; unfold straight; simpl; set (rows := length (times r)) in *.
  pose proof (path_between k s Hs _ (map (row_at r i) (seq 0 rows)) (increasing_rows rows 0)) as [_ B].
  - rewrite !map_length; reflexivity.
  - rewrite map_length, seq_length; exact K.
  - unfold on_way in B; rewrite !nth_row, S_INR in B by lia; unfold step_of; rewrite <- B; f_equal; ring.
Qed.

Lemma straight_recorded r i : as_recorded r i (straight r i).
Proof.
  split; [reflexivity | split; [simpl; lra | split; [reflexivity |]]]; intros k s K Hs.
  assert (Z : forall x : vec, norm (sub x x) <= 0).
  { intros x; right; rewrite <- norm_0; f_equal; apply vec_eq; vectors; ring. }
  change (place (straight r i)) with (steered (straight r i)); rewrite straight_at by assumption; cbv zeta.
  replace (sub (sub (add (row_at r i k) (scale s (step_of r i k))) (row_at r i k)) (scale s (step_of r i k)))
    with (V 0 0 0) by (apply vec_eq; vectors; ring); rewrite norm_0; simpl.
  split; [lra | split; [intros _; lra |]]; apply Z.
Qed.

(** THEOREM: On straight lines the places are the positions that the theorem about distances is about.
    - The hypotheses of DistanceChecker.sound. *)
Theorem straight_is r t : well_formed r = true -> begins r <= t <= ends r -> exists k s,
  (S k < length (times r))%nat /\ 0 <= s <= 1 /\
  forall i, has_rows r i = true -> position r i t = place (straight r i) (INR k + s).
Proof.
  intros W Ht; destruct (position_at r t W Ht) as [k [s [K [Hs P]]]]; exists k, s; repeat split; try assumption;
    try lra.
  intros i Hi; rewrite (P i Hi); change (place (straight r i)) with (steered (straight r i)).
  rewrite straight_at by assumption; apply well_formed_means in W; destruct W as [_ [U _]].
  unfold step_of, row_at, row, on_way; rewrite !nth_real; unfold place_in, metres, real.
  apply vec_eq; vectors; field; lra.
Qed.

(** * The law *)

Lemma meets_law_sound num den d e x v : (0 < num)%Z -> (num <= den)%Z -> (0 <= d)%Z ->
  meets_law num den d e x v = true ->
  0 < norm (real x) /\
  bound 1 (IZR num / IZR den) (IZR d) (norm (real x)) - IZR e <= dot (real x) (real v) / norm (real x).
Proof.
  intros Hn Hd Hs H; unfold meets_law in H; split_ifs.
  assert (Pn : 0 < IZR num) by (apply IZR_lt; lia); assert (Pd : 0 < IZR den) by (apply IZR_lt; lia).
  assert (Ps : 0 <= IZR d) by (apply IZR_le; lia).
  set (D2 := product x x) in *; set (c := if (D2 <=? d * d)%Z then num else den) in *.
  pose proof (norm_nonneg (real x)) as N0; pose proof (norm_square (real x)) as N2.
  rewrite <- real_product in N2; fold D2 in N2; set (D := norm (real x)) in *.
  assert (B : IZR den * bound 1 (IZR num / IZR den) (IZR d) D = IZR c * (IZR d - D)).
  { unfold bound, c; destruct (D2 <=? d * d)%Z eqn:C; to_reals.
    - destruct (Rle_dec D (IZR d)) as [| N]; [field; lra | exfalso; apply N; apply Rsqr_incr_0_var; unfold Rsqr; lra].
    - destruct (Rle_dec D (IZR d)) as [L |]; [exfalso; nra | field; lra]. }
  set (w := (den * product x v + c * D2)%Z) in *; set (m := (c * d - den * e)%Z) in *.
  assert (W : IZR m * D <= IZR w).
  { destruct (m <=? 0)%Z eqn:M; to_reals; [nra |].
    apply Rsqr_incr_0_var; [unfold Rsqr; rewrite <- N2 in H; nra | assumption]. }
  assert (Dp : 0 < D).
  { apply Z.ltb_lt, IZR_lt in Heqb; destruct (Req_dec D 0) as [Z |]; [rewrite Z in N2; lra | lra]. }
  split; [exact Dp |].
  unfold w, m in W; rewrite plus_IZR, minus_IZR, !mult_IZR, real_product in W; rewrite <- N2 in W.
  apply Rmult_le_reg_r with D; [exact Dp |].
  replace (dot (real x) (real v) / D * D) with (dot (real x) (real v)) by (field; lra).
  apply Rmult_le_reg_l with (IZR den); [exact Pd |].
  replace (IZR den * ((bound 1 (IZR num / IZR den) (IZR d) D - IZR e) * D))
    with ((IZR den * bound 1 (IZR num / IZR den) (IZR d) D) * D - IZR den * IZR e * D) by ring.
  rewrite B; nra.
Qed.

(** The law has the same form in parts as in metres. *)
Lemma bound_scales g d D u : 0 < u -> bound 1 g (d / u) (D / u) = bound 1 g d D / u.
Proof.
  intros U; assert (E : forall x y, x / u <= y / u <-> x <= y).
  { intros x y; split; intros L; [apply Rmult_le_reg_r with (/ u) | apply Rmult_le_compat_r]; try exact L;
      [apply Rinv_0_lt_compat | apply Rlt_le, Rinv_0_lt_compat]; exact U. }
  unfold bound; destruct (Rle_dec (D / u) (d / u)) as [L | L], (Rle_dec D d) as [M | M]; rewrite E in L;
    contradiction || (field; lra).
Qed.


Lemma obeys_law_means r i j num den a b e K N : obeys_law r i j num den a b e K N = true ->
  exists d, IZR d * IZR b = IZR a * IZR (unit r) /\ (0 < b)%Z /\ has_rows r i = true /\ has_rows r j = true /\
  (0 < num)%Z /\ (num <= den)%Z /\ (0 <= d)%Z /\ (0 <= e)%Z /\ (0 < N)%nat /\ (K + N < length (times r))%nat /\
  starts_within num den d e (row (track_of r i) K) (row (track_of r j) K) = true /\
  some_steps (step_meets num den d e (stride (track_of r i) + stride (track_of r j))) N
    (skipn K (places (track_of r i))) (skipn K (places (track_of r j))) = true.
Proof.
  unfold obeys_law; set (d := (a * unit r / b)%Z); intros H; split_ifs; exists d; rewrite <- !mult_IZR.
  rewrite Z.ltb_lt, Z.leb_le, Z.eqb_eq, Nat.ltb_lt in *; repeat split; auto; congruence.
Qed.

Lemma row_in_metres r i j k : 0 < IZR (unit r) -> sub (row_at r i k) (row_at r j k) =
  scale (/ IZR (unit r)) (real (minus (row (track_of r i) k) (row (track_of r j) k))).
Proof. intros U; rewrite real_minus; unfold row_at, place_in, metres, real; apply vec_eq; vectors; field; lra. Qed.

(** THEOREM (7)-(8), (11): Entries that the checker accepts were checked: the pair of points obeys the law in their
    periods, up to e.
    - The hypotheses of DistanceChecker.sound.
    - The bodies are as recorded: no farther off the straight lines between the rows than is said of them. *)
Theorem sound r i j bi bj num den a b e K N d : well_formed r = true -> obeys_law r i j num den a b e K N = true ->
  as_recorded r i bi -> as_recorded r j bj ->
  let n := Numbers (IZR num / IZR den) (IZR a / IZR b) 0 (metres r e) (metres r e) in
  0 < kept_by n -> 0 <= d + cover bi + cover bj + dip bi + dip bj <= kept_by n ->
  checked 1 (Entry K N (Together bi bj points n d)).
Proof.
  intros W H Bi Bj n R0 Rd; apply obeys_law_means in H.
  destruct H as [q [Eq [B [Ri [Rj [Hn [Hd [Hq [He [HN [HK [St0 H]]]]]]]]]]]].
  pose proof (listed_ok r i W Ri) as Ti; pose proof (listed_ok r j W Rj) as Tj.
  pose proof W as U; apply well_formed_means in U; destruct U as [_ [U _]]; apply IZR_lt in B.
  assert (IU : 0 < / IZR (unit r)) by apply Rinv_0_lt_compat, U.
  assert (Pn : 0 < IZR num) by (apply IZR_lt; lia); assert (Pd : IZR num <= IZR den) by (apply IZR_le; lia).
  assert (Pe : 0 <= IZR e) by (apply IZR_le; lia).
  assert (G : 0 < IZR num / IZR den <= 1).
  { split; [apply Rdiv_lt_0_compat; lra | apply Rmult_le_reg_r with (IZR den); [lra | field_simplify; lra]]. }
  assert (D : IZR a / IZR b = IZR q / IZR (unit r)).
  { apply Rmult_eq_reg_r with (IZR b * IZR (unit r)); [field_simplify; lra | nra]. }
  assert (E0 : 0 <= metres r e) by (apply Rle_mult_inv_pos; assumption).
  pose proof (proj1 Bi) as Di; pose proof (proj1 Bj) as Dj.
  assert (At : forall k, (S k < length (times r))%nat -> apart bi bj (sample 1 k) =
    scale (/ IZR (unit r)) (real (minus (row (track_of r i) k) (row (track_of r j) k)))).
  { intros k Hk; unfold apart, sample; rewrite Rmult_1_r, (recorded_at r i), (recorded_at r j) by assumption.
    apply row_in_metres, U. }
  unfold checked, what, first, many; split; [| split].
  - unfold budgeted; fold n; rewrite Di, Dj; unfold n; simpl gain; simpl dlaw; simpl err; simpl short; simpl loss.
    fold n; set (t := d + cover bi + cover bj + dip bi + dip bj) in *.
    replace (t ^ 2 + 0 ^ 2) with (t * t) by ring; rewrite sqrt_square by lra.
    unfold kept_by, n in Rd, R0 |- *; simpl in Rd, R0 |- *; repeat split; try lra; nra.
  - apply clear_points; rewrite At by lia; rewrite norm_scale by lra.
    unfold starts_within in St0; set (x := minus _ _) in *.
    pose proof (norm_nonneg (real x)) as N0; pose proof (norm_square (real x)) as N2.
    assert (M : IZR num * IZR q - IZR den * IZR e <= IZR num * norm (real x)).
    { destruct (_ <=? 0)%Z eqn:C; to_reals; [nra |].
      apply Rsqr_incr_0_var; [unfold Rsqr; rewrite <- N2 in St0; nra | nra]. }
    unfold kept_by, n; simpl; rewrite D; unfold metres; apply Rmult_le_reg_l with (IZR num * IZR (unit r)); [nra |].
    replace (IZR num * IZR (unit r) * (IZR q / IZR (unit r) - 0 - IZR e / IZR (unit r) / (IZR num / IZR den)))
      with (IZR num * IZR q - IZR den * IZR e) by (field; lra).
    replace (IZR num * IZR (unit r) * (/ IZR (unit r) * norm (real x))) with (IZR num * norm (real x)) by (field; lra).
    exact M.
  - intros k Hk; split; [apply (recorded_conforms r i); [assumption | lia] |].
    split; [apply (recorded_conforms r j); [assumption | lia] |].
    pose proof (some_step_at _ (P 0 0 0) (k - K) _ _ _ H ltac:(lia)) as St; unfold step_meets in St.
    rewrite !nth_skip in St; replace (K + (k - K))%nat with k in St by lia.
    replace (K + S (k - K))%nat with (S k) in St by lia.
    unfold has_rows in *; apply Nat.eqb_eq in Ri, Rj.
    pose proof (moves_within _ k (P 0 0 0) Ti ltac:(lia)) as Mi.
    pose proof (moves_within _ k (P 0 0 0) Tj ltac:(lia)) as Mj.
    destruct Bi as [_ [_ [Ci _]]]; destruct Bj as [_ [_ [Cj _]]].
    assert (Cm : forall t, step_of r t k =
      scale (/ IZR (unit r)) (sub (real (row (track_of r t) (S k))) (real (row (track_of r t) k)))).
    { intros t; unfold step_of, row_at, place_in, metres, real; apply vec_eq; vectors; field; lra. }
    fold (row (track_of r i) k) (row (track_of r i) (S k)) in Mi, St.
    fold (row (track_of r j) k) (row (track_of r j) (S k)) in Mj, St.
    unfold pair_law; rewrite (At k) by lia; rewrite Ci, Cj, Di, Dj, !Cm; simpl dlaw; simpl gain; simpl short; rewrite D.
    set (p := row (track_of r i) k) in *; set (p' := row (track_of r i) (S k)) in *.
    set (o := row (track_of r j) k) in *; set (o' := row (track_of r j) (S k)) in *.
    set (x := minus p o) in *; destruct (is_far _ _) eqn:F; [right; left | left].
    + assert (Less : kept_by n <= IZR q / IZR (unit r)).
      { assert (0 <= loss n / gain n) by (apply Rle_mult_inv_pos; [exact E0 | apply G]).
        unfold kept_by; simpl dlaw; simpl err; lra. }
      apply far_sound in F; rewrite !plus_IZR in F; apply clear_points; rewrite !norm_scale by lra.
      apply Rle_trans with (1 := Rplus_le_compat_r _ _ _ Less).
      replace (IZR q / IZR (unit r)) with (/ IZR (unit r) * IZR q) by (field; lra).
      rewrite !Rplus_0_r, Rmult_1_r, <- !Rmult_plus_distr_l; apply Rmult_le_compat_l; lra.
    + apply meets_law_sound in St; try assumption; destruct St as [Pos M].
      exists (scale (/ IZR (unit r)) (real x)), (V 0 0 0), (scale (/ norm (real x)) (real x)).
      assert (E : sub (scale (/ IZR (unit r)) (real x)) (V 0 0 0) = scale (/ IZR (unit r)) (real x))
        by (apply vec_eq; vectors; ring).
      split; [simpl err; right; rewrite <- norm_0; f_equal; apply vec_eq; vectors; ring | split].
      * apply nearest_of_points; destruct (along_unit (real x) Pos) as [Un Al]; split; [exact Un |].
        rewrite norm_scale by lra; rewrite Al at 1; apply vec_eq; vectors; ring.
      * rewrite E, norm_scale by lra; replace (/ IZR (unit r) * norm (real x)) with (norm (real x) / IZR (unit r))
          by (field; lra); rewrite bound_scales by exact U; unfold metres.
        rewrite !real_minus in M; set (y := real x) in *.
        match type of M with _ <= dot y ?v / _ => set (w := v) in * end.
        match goal with |- _ <= ?rhs => replace rhs with (/ IZR (unit r) * (dot y w / norm y))
          by (unfold w; vectors; field; lra) end.
        replace (bound 1 _ _ _ / IZR (unit r) - IZR e / IZR (unit r))
          with (/ IZR (unit r) * (bound 1 (IZR num / IZR den) (IZR q) (norm y) - IZR e)) by (field; lra).
        apply Rmult_le_compat_l; lra.
Qed.

(** By how much the body may be off the recorded straight lines, m. *)
Definition off b := cover b + dip b.

(** Bodies of which the run is a record; body [i] may be off it by [most i]. *)
Definition recorded (r : run) (most : nat -> R) (b : nat -> body) := forall i, as_recorded r i (b i) /\ off (b i) <=
  most i.

(** THEOREM: Bodies that move on the straight lines between the rows are recorded, and nothing is off.
    - The hypotheses of DistanceChecker.sound. *)
Lemma first_order_recorded r : recorded r (fun _ => 0) (straight r).
Proof. intros i; split; [apply straight_recorded | unfold off; simpl; lra]. Qed.

(** [l] is the distance of the law, and [d] what the bodies keep. *)
(** THEOREM (7)-(8), (11): Entries accepted without error were checked with e = 0, for the distance of the law and that of
    the bodies.
    - The hypotheses of LawChecker.sound.
    - The distance of the law is at least what the bodies keep and are off. *)
Corollary obeys_exactly r most bodies i j num den a b K N g l d : well_formed r = true ->
  obeys_law r i j num den a b 0 K N = true -> recorded r most bodies ->
  g = IZR num / IZR den -> l = IZR a / IZR b -> 0 <= d -> 0 < l -> d + most i + most j <= l ->
  checked 1 (Entry K N (Together (bodies i) (bodies j) points (Numbers g l 0 0 0) d)).
Proof.
  intros W H R -> -> Hd Hl Ho; assert (Z : metres r 0 = 0) by (unfold metres, Rdiv; ring).
  destruct (R i) as [Bi Oi], (R j) as [Bj Oj].
  pose proof (sound r i j _ _ num den a b 0 K N d W H Bi Bj) as S; cbv zeta in S; rewrite Z in S.
  assert (C : forall q c, as_recorded r q c -> 0 <= off c).
  { intros q c [_ [P [_ Q]]]; apply well_formed_means in W; destruct W as [L _].
    destruct (Q 0%nat 0 ltac:(lia) ltac:(lra)) as [_ [_ T]].
    pose proof (norm_nonneg (sub (place c (INR 0 + 0)) (steered c (INR 0 + 0)))); unfold off; lra. }
  pose proof (C i _ Bi); pose proof (C j _ Bj); unfold off in *.
  assert (E : kept_by (Numbers (IZR num / IZR den) (IZR a / IZR b) 0 0 0) = IZR a / IZR b)
    by (unfold kept_by; simpl; unfold Rdiv; ring).
  apply S; rewrite E; lra.
Qed.
