(** Whether a recorded run obeys the avoidance law of Safety.v, up to an error: decided exactly. *)
Require Import Reals Lra Psatz ZArith List Bool Lia.
Require Import Safety Run.
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

(** At the first row the pair lacks at most [e / gain] of its safe distance. *)
Definition starts_within (num den d e : Z) (p q : point) :=
  let m := num * d - den * e in
  if m <=? 0 then true else let x := minus p q in m * m <=? num * num * product x x.

Definition first (b : body) := nth 0 (places b) (P 0 0 0).

(** Bodies [i] and [j], safe distance [a / b] metres (a whole number of parts), error [e] parts a step. *)
Definition obeys_law (r : run) (i j : nat) (num den a b e : Z) :=
  let u := body_of r i in let v := body_of r j in let d := a * unit r / b in
  if 0 <? b then if d * b =? a * unit r then if has_rows r i then if has_rows r j then
  if 0 <? num then if num <=? den then if 0 <=? d then if 0 <=? e then
  if starts_within num den d e (first u) (first v) then
  all_steps (step_meets num den d e (stride u + stride v)) (places u) (places v)
  else false else false else false else false else false else false else false else false else false.

(** * What it means *)
Local Open Scope R_scope.

(** The difference of two bodies' positions at row [k], m, and by how much it changes up to the next row. *)
Definition offset r i j k := scale (/ IZR (unit r)) (apart_at (body_of r i) (body_of r j) k 0).
Definition change r i j k := sub (offset r i j (S k)) (offset r i j k).

(** In every step the two are too far apart to matter, or they approach no faster than the law allows, up to [e].
    [g] is A h, [d] the safe distance, m, and [e] the error, m per step. *)
Definition obeys (r : run) (g : R) (i j : nat) (d e : R) := forall k, (S k < length (times r))%nat ->
  let D := norm (offset r i j k) in
  d + norm (change r i j k) <= D \/ 0 < D /\ bound 1 g d D - e <= dot (offset r i j k) (change r i j k) / D.

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

Lemma obeys_law_means r i j num den a b e : obeys_law r i j num den a b e = true ->
  exists d, IZR d * IZR b = IZR a * IZR (unit r) /\ (0 < b)%Z /\ has_rows r i = true /\ has_rows r j = true /\
  (0 < num)%Z /\ (num <= den)%Z /\ (0 <= d)%Z /\ (0 <= e)%Z /\
  starts_within num den d e (first (body_of r i)) (first (body_of r j)) = true /\
  all_steps (step_meets num den d e (stride (body_of r i) + stride (body_of r j)))
    (places (body_of r i)) (places (body_of r j)) = true.
Proof.
  unfold obeys_law; set (d := (a * unit r / b)%Z); intros H; split_ifs; exists d; rewrite <- !mult_IZR.
  rewrite Z.ltb_lt, Z.leb_le, Z.eqb_eq in *; repeat split; auto; congruence.
Qed.

Lemma apart_at_row b c k : apart_at b c k 0 = real (minus (nth k (places b) (P 0 0 0)) (nth k (places c) (P 0 0 0))).
Proof. rewrite real_minus, <- !nth_real; unfold apart_at, on_way; apply vec_eq; vectors; ring. Qed.

Lemma on_way_straight ps k s :
  on_way ps k s = add (on_way ps k 0) (scale s (sub (on_way ps (S k) 0) (on_way ps k 0))).
Proof. unfold on_way; apply vec_eq; vectors; ring. Qed.

(** The law has the same form in parts as in metres. *)
Lemma bound_scales g d D u : 0 < u -> bound 1 g (d / u) (D / u) = bound 1 g d D / u.
Proof.
  intros U; assert (E : forall x y, x / u <= y / u <-> x <= y).
  { intros x y; split; intros L; [apply Rmult_le_reg_r with (/ u) | apply Rmult_le_compat_r]; try exact L;
      [apply Rinv_0_lt_compat | apply Rlt_le, Rinv_0_lt_compat]; exact U. }
  unfold bound; destruct (Rle_dec (D / u) (d / u)) as [L | L], (Rle_dec D d) as [M | M]; rewrite E in L;
    contradiction || (field; lra).
Qed.

(** ** Soundness: what the checker accepts obeys the law. *)
Theorem sound r i j num den a b e : well_formed r = true -> obeys_law r i j num den a b e = true ->
  obeys r (IZR num / IZR den) i j (IZR a / IZR b) (metres r e).
Proof.
  intros W H k K; apply obeys_law_means in H; destruct H as [d [Ed [B [Ri [Rj [Hn [Hd [Hs [He [_ H]]]]]]]]]].
  pose proof (listed_ok r i W Ri) as Bi; pose proof (listed_ok r j W Rj) as Bj.
  apply well_formed_means in W; destruct W as [_ [U _]]; apply IZR_lt in B.
  unfold has_rows in *; apply Nat.eqb_eq in Ri, Rj.
  pose proof (step_at _ k _ _ H ltac:(lia) ltac:(congruence) (P 0 0 0)) as St; unfold step_meets in St.
  pose proof (moves_within _ k (P 0 0 0) Bi ltac:(lia)) as Mi.
  pose proof (moves_within _ k (P 0 0 0) Bj ltac:(lia)) as Mj.
  assert (V : 0 < / IZR (unit r)) by apply Rinv_0_lt_compat, U.
  assert (D : IZR a / IZR b = IZR d / IZR (unit r)).
  { apply Rmult_eq_reg_r with (IZR b * IZR (unit r)); [field_simplify; lra | nra]. }
  unfold change, offset; rewrite scale_sub, !apart_at_row, !norm_scale, D by lra.
  set (p := nth k (places (body_of r i)) (P 0 0 0)) in *; set (p' := nth (S k) (places (body_of r i)) (P 0 0 0)) in *.
  set (q := nth k (places (body_of r j)) (P 0 0 0)) in *; set (q' := nth (S k) (places (body_of r j)) (P 0 0 0)) in *.
  assert (X : sub (real (minus p' q')) (real (minus p q)) = real (minus (minus p' p) (minus q' q))).
  { rewrite !real_minus; apply vec_eq; vectors; ring. }
  rewrite X; set (x := real (minus p q)) in *; set (v := real (minus (minus p' p) (minus q' q))) in *.
  destruct (is_far _ _) eqn:F; [left | right].
  - apply far_sound in F; rewrite !plus_IZR in F; fold x in F.
    assert (N : norm v <= IZR (stride (body_of r i)) + IZR (stride (body_of r j))).
    { unfold v; rewrite !real_minus; eapply Rle_trans; [apply norm_difference | lra]. }
    unfold Rdiv; rewrite (Rmult_comm (IZR d)), <- Rmult_plus_distr_l; apply Rmult_le_compat_l; lra.
  - apply meets_law_sound in St; try assumption; fold x v in St; destruct St as [Pos M]; split; [nra |].
    replace (/ IZR (unit r) * norm x) with (norm x / IZR (unit r)) by (field; lra).
    rewrite bound_scales by exact U; unfold metres.
    replace (dot (scale (/ IZR (unit r)) x) (scale (/ IZR (unit r)) v) / (norm x / IZR (unit r)))
      with (/ IZR (unit r) * (dot x v / norm x)) by (vectors; field; lra).
    replace (bound 1 _ _ _ / IZR (unit r) - IZR e / IZR (unit r))
      with (/ IZR (unit r) * (bound 1 (IZR num / IZR den) (IZR d) (norm x) - IZR e)) by (field; lra).
    apply Rmult_le_compat_l; lra.
Qed.

(** * Why obeying the law keeps the distance: [disturbed] of Safety.v, for the one body as the other sees it *)
Section Seen.

Variables (r : run) (i j : nat) (g d e : R).
Hypotheses (W : well_formed r = true) (Ri : has_rows r i = true) (Rj : has_rows r j = true).
Hypotheses (g_positive : 0 < g) (no_overshoot : g <= 1) (e_nonneg : 0 <= e) (law : obeys r g i j d e).
Hypothesis start : d - e / g <= norm (offset r i j 0).

Let rows := length (times r).
Let sampled k := (S k < rows)%nat.
(** Time in steps. The other body, [false], stands at 0. *)
Let seen (who : bool) t :=
  if who then path (map INR (seq 0 rows)) (map (offset r i j) (seq 0 rows)) t else origin.
Let step (who : bool) k := if who then change r i j k else origin.

Lemma nth_row (A : Type) (f : nat -> A) k o : (k < rows)%nat -> nth k (map f (seq 0 rows)) o = f k.
Proof.
  intros H; rewrite nth_indep with (d' := f 0%nat) by (rewrite map_length, seq_length; exact H).
  rewrite map_nth, seq_nth by exact H; reflexivity.
Qed.

Lemma increasing_rows n : forall a, increasing (map INR (seq a n)).
Proof.
  induction n as [| [| n] IH]; intros a; [exact I | exact I |]; specialize (IH (S a)); split; [| exact IH].
  rewrite S_INR; lra.
Qed.

Lemma seen_at k s : sampled k -> 0 <= s <= 1 ->
  seen true (sample 1 k + s) = add (offset r i j k) (scale s (change r i j k)).
Proof.
  unfold sampled; intros K Hs; unfold seen, sample.
  pose proof (path_between k s Hs _ (map (offset r i j) (seq 0 rows)) (increasing_rows rows 0)) as [_ B].
  - rewrite !map_length; reflexivity.
  - rewrite map_length, seq_length; exact K.
  - unfold on_way in B; rewrite !nth_row, S_INR in B by lia; unfold change; rewrite <- B; f_equal; ring.
Qed.

Lemma offset_between k s : scale (/ IZR (unit r)) (apart_at (body_of r i) (body_of r j) k s) =
  add (offset r i j k) (scale s (change r i j k)).
Proof.
  unfold change, offset, apart_at.
  rewrite (on_way_straight (map real (places (body_of r i))) k s).
  rewrite (on_way_straight (map real (places (body_of r j))) k s).
  generalize (on_way (map real (places (body_of r i)))) (on_way (map real (places (body_of r j)))); intros f q.
  apply vec_eq; vectors; ring.
Qed.

Theorem obeying_keeps : forall t, begins r <= t <= ends r -> d - e / g <= norm (sub (position r i t) (position r j t)).
Proof.
  intros t Ht; destruct (difference_at r i j t W Ri Rj Ht) as [k [s [K [Hs ->]]]].
  pose proof W as U; apply well_formed_means in U; destruct U as [_ [U _]].
  pose (gap := fun _ _ : bool => norm).
  assert (At : forall l q, sampled l -> 0 <= q <= 1 ->
    distance bool seen gap true false (sample 1 l + q) = norm (add (offset r i j l) (scale q (change r i j l)))).
  { intros l q Hl Hq; unfold distance, difference, gap; rewrite seen_at by assumption; f_equal; apply vec_eq;
      unfold seen, origin; vectors; ring. }
  assert (At0 : forall l, sampled l -> distance bool seen gap true false (sample 1 l) = norm (offset r i j l)).
  { intros l Hl; replace (sample 1 l) with (sample 1 l + 0) by ring; rewrite At by (assumption || lra).
    f_equal; apply vec_eq; vectors; ring. }
  rewrite offset_between, <- At by assumption.
  apply (disturbed 1 g ltac:(lra) ltac:(lra) bool seen step (fun _ => V 1 1 1) (fun _ => 0) gap
    (fun a b => a = true /\ b = false) (fun _ _ => d) (fun a _ => if a then 1 else 0)
    (fun a _ => if a then e else 0) sampled); try lra; try (split; reflexivity); auto.
  - unfold sampled; lia.
  - intros [] l q Hl Hq; right; rewrite Rmult_0_l, <- norm_origin; f_equal; unfold moved.
    + replace (sample 1 l) with (sample 1 l + 0) at 2 by ring; rewrite !seen_at by (assumption || lra).
      apply vec_eq; unfold step, origin; vectors; ring.
    + apply vec_eq; unfold seen, step, origin; vectors; ring.
  - intros a l; apply vec_eq; vectors; ring.
  - intros a b [-> ->]; split; [reflexivity | intros x; unfold gap, norm; f_equal; vectors; ring].
  - intros a b x _; apply away_exists.
  - intros a b [-> ->]; ring.
  - intros a b l Hl [-> ->]; specialize (law l Hl); cbv zeta in law; destruct law as [F | [Pos M]].
    + right; unfold far; rewrite At0 by exact Hl; change (step false l) with origin; rewrite norm_origin.
      unfold step; lra.
    + left; exists (scale (/ norm (offset r i j l)) (offset r i j l)).
      assert (X : sub (seen true (sample 1 l)) (seen false (sample 1 l)) = offset r i j l).
      { replace (sample 1 l) with (sample 1 l + 0) at 1 by ring; rewrite seen_at by (assumption || lra).
        apply vec_eq; unfold seen, origin; vectors; ring. }
      split; [| split].
      * apply away_from_point; unfold difference; rewrite X; apply along_unit, Pos.
      * unfold meets; rewrite At0 by exact Hl; eapply Rle_trans; [| eapply Rle_trans; [exact M |]]; [lra |].
        right; unfold step; vectors; field; lra.
      * apply obstacle; reflexivity.
  - unfold missed; lra.
  - replace 0 with (sample 1 0) by (unfold sample; simpl; ring); rewrite At0; [exact start |].
    unfold sampled; lia.
Qed.

End Seen.

(** ** What the checker accepts keeps its distance, but for [e / (A h)]. *)
Theorem law_keeps r i j num den a b e : well_formed r = true -> obeys_law r i j num den a b e = true ->
  forall t, begins r <= t <= ends r ->
  IZR a / IZR b - metres r e / (IZR num / IZR den) <= norm (sub (position r i t) (position r j t)).
Proof.
  intros W H; pose proof (sound r i j num den a b e W H) as L; apply obeys_law_means in H.
  destruct H as [d [Ed [B [Ri [Rj [Hn [Hd [_ [He [S _]]]]]]]]]].
  pose proof W as U; apply well_formed_means in U; destruct U as [_ [U _]].
  apply IZR_lt in B, Hn; apply IZR_le in Hd, He.
  apply obeying_keeps; try assumption.
  - apply Rdiv_lt_0_compat; lra.
  - apply Rmult_le_reg_r with (IZR den); [lra | field_simplify; lra].
  - apply Rle_mult_inv_pos; assumption.
  - unfold offset; rewrite apart_at_row, norm_scale by apply Rlt_le, Rinv_0_lt_compat, U.
    unfold starts_within, first in S; set (x := minus _ _) in *.
    pose proof (norm_nonneg (real x)) as N0; pose proof (norm_square (real x)) as N2.
    assert (M : IZR num * IZR d - IZR den * IZR e <= IZR num * norm (real x)).
    { destruct (_ <=? 0)%Z eqn:C; to_reals; [nra |].
      apply Rsqr_incr_0_var; [unfold Rsqr; rewrite <- N2 in S; nra | nra]. }
    assert (D : IZR a / IZR b = IZR d / IZR (unit r)).
    { apply Rmult_eq_reg_r with (IZR b * IZR (unit r)); [field_simplify; lra | nra]. }
    rewrite D; unfold metres; apply Rmult_le_reg_l with (IZR num * IZR (unit r)); [nra |].
    replace (IZR num * IZR (unit r) * (IZR d / IZR (unit r) - IZR e / IZR (unit r) / (IZR num / IZR den)))
      with (IZR num * IZR d - IZR den * IZR e) by (field; lra).
    replace (IZR num * IZR (unit r) * (/ IZR (unit r) * norm (real x))) with (IZR num * norm (real x)) by (field; lra).
    exact M.
Qed.

(** ** The law without error, in plain numbers *)
Corollary obeys_exactly r i j num den a b g d : well_formed r = true -> obeys_law r i j num den a b 0 = true ->
  g = IZR num / IZR den -> d = IZR a / IZR b -> obeys r g i j d 0.
Proof.
  intros W H -> ->; pose proof (sound r i j num den a b 0 W H) as S; unfold metres in S.
  replace (0 / IZR (unit r)) with 0 in S by (unfold Rdiv; ring); exact S.
Qed.
