(** Whether a recorded run keeps a distance at all times: decided exactly, from positions alone. *)
Require Import Reals Lra Psatz ZArith List Bool Lia.
Require Import Safety Run.
Local Open Scope Z_scope.

(** * What is computed *)

(** [d <= norm (x + s v)] for all [s] in [0, 1]: where the square of the right side is least decides. *)
Definition stays_beyond (d : Z) (x v : point) :=
  let xx := product x x in let xv := product x v in let vv := product v v in
  if 0 <=? xv then d * d <=? xx
  else if xv + vv <=? 0 then d * d <=? xx + 2 * xv + vv
  else (d * d - xx) * vv <=? - (xv * xv).

(** One step of two bodies from [p] to [p'], and from [q] to [q']; both move by [reach] at most in all. *)
Definition step_keeps (d reach : Z) (p p' q q' : point) :=
  let x := minus p q in
  if is_far (d + reach) x then true else stays_beyond d x (minus (minus p' q') x).

(** [a / b] metres in parts, rounded up. *)
Definition parts_up (r : run) (a b : Z) := - (- (a * unit r) / b).

(** Bodies [i] and [j] keep [a / b] metres. *)
Definition keeps (r : run) (i j : nat) (a b : Z) :=
  let u := body_of r i in let v := body_of r j in
  if 0 <? b then if has_rows r i then if has_rows r j then
  all_steps (step_keeps (parts_up r a b) (stride u + stride v)) (places u) (places v)
  else false else false else false.

(** * What it means *)
Local Open Scope R_scope.

Lemma stays_beyond_sound d x v s : 0 <= s <= 1 -> stays_beyond d x v = true ->
  IZR d <= norm (add (real x) (scale s (real v))).
Proof.
  intros Hs H; apply norm_at_least.
  replace (dot (add (real x) (scale s (real v))) (add (real x) (scale s (real v))))
    with (dot (real x) (real x) + 2 * s * dot (real x) (real v) + s * s * dot (real v) (real v)) by (vectors; ring).
  rewrite <- !real_product; assert (V : 0 <= IZR (product v v)) by (rewrite real_product; vectors; nra).
  unfold stays_beyond in H; destruct (0 <=? product x v)%Z eqn:C1; [| destruct (_ <=? 0)%Z eqn:C2].
  all: apply Z.leb_le, IZR_le in H; rewrite ?plus_IZR, ?opp_IZR, ?mult_IZR, ?minus_IZR, ?plus_IZR, ?mult_IZR in H.
  all: set (xx := IZR (product x x)) in *; set (vv := IZR (product v v)) in *.
  - (* The bodies move apart: least at [s = 0]. *)
    apply Z.leb_le, IZR_le in C1; set (xv := IZR (product x v)) in *; nra.
  - (* They approach all the time: least at [s = 1]. *)
    apply Z.leb_le, IZR_le in C2; rewrite plus_IZR in C2; set (xv := IZR (product x v)) in *; fold vv in C2.
    replace (xx + 2 * s * xv + s * s * vv)
      with (xx + 2 * xv + vv - 2 * (1 - s) * (xv + vv) + (1 - s) * (1 - s) * vv) by ring.
    assert (0 <= (1 - s) * - (xv + vv)) by (apply Rmult_le_pos; lra).
    assert (0 <= (1 - s) * (1 - s) * vv) by (apply Rmult_le_pos; [nra | exact V]); lra.
  - (* Least between, at [s = - xv / vv]. *)
    apply Z.leb_gt, IZR_lt in C1; apply Z.leb_gt, IZR_lt in C2; rewrite plus_IZR in C2; fold vv in C2.
    set (xv := IZR (product x v)) in *.
    assert (0 < vv) by lra; apply Rmult_le_reg_r with vv; [assumption |].
    pose proof (Rle_0_sqr (s * vv + xv)); unfold Rsqr in *; nra.
Qed.

Lemma step_sound d b c k s : body_ok b = true -> body_ok c = true -> length (places c) = length (places b) ->
  all_steps (step_keeps d (stride b + stride c)) (places b) (places c) = true ->
  (S k < length (places b))%nat -> 0 <= s <= 1 -> IZR d <= norm (apart_at b c k s).
Proof.
  intros Hb Hc L H K Hs; pose proof (step_at _ k _ _ H K L (P 0 0 0)) as St; unfold step_keeps in St.
  pose proof (moves_within b k (P 0 0 0) Hb K) as Sb.
  pose proof (moves_within c k (P 0 0 0) Hc ltac:(rewrite L; exact K)) as Sc.
  unfold apart_at, on_way; rewrite !nth_real.
  set (p := nth k (places b) (P 0 0 0)) in *; set (p' := nth (S k) (places b) (P 0 0 0)) in *.
  set (q := nth k (places c) (P 0 0 0)) in *; set (q' := nth (S k) (places c) (P 0 0 0)) in *.
  set (y := sub (add (real p) _) _); destruct (is_far _ _) eqn:F.
  - apply far_sound in F; rewrite !plus_IZR, real_minus in F.
    set (w := sub (sub (real p') (real p)) (sub (real q') (real q))).
    assert (W : norm w <= IZR (stride b) + IZR (stride c)) by (eapply Rle_trans; [apply norm_difference | lra]).
    pose proof (norm_difference y (scale s w)) as T; rewrite norm_scale in T by lra.
    replace (sub y (scale s w)) with (sub (real p) (real q)) in T by (apply vec_eq; unfold y, w; vectors; ring).
    pose proof (norm_nonneg w); nra.
  - apply (stays_beyond_sound _ _ _ s Hs) in St; rewrite !real_minus in St.
    replace y with (add (sub (real p) (real q)) (scale s (sub (sub (real p') (real q')) (sub (real p) (real q)))))
      by (apply vec_eq; unfold y; vectors; ring); exact St.
Qed.

Lemma keeps_means r i j a b : keeps r i j a b = true ->
  0 < IZR b /\ has_rows r i = true /\ has_rows r j = true /\
  all_steps (step_keeps (parts_up r a b) (stride (body_of r i) + stride (body_of r j)))
    (places (body_of r i)) (places (body_of r j)) = true.
Proof. unfold keeps; intros H; split_ifs; to_reals; auto. Qed.

Lemma parts_up_sound r a b : 0 < IZR b -> IZR a * IZR (unit r) <= IZR (parts_up r a b) * IZR b.
Proof.
  intros B; apply lt_IZR in B; rewrite <- !mult_IZR; apply IZR_le; unfold parts_up.
  pose proof (Z.mul_div_le (- (a * unit r)) b B); lia.
Qed.

(** ** Soundness: two bodies that the checker accepts keep their distance at all times of the run. *)
Theorem sound r i j a b : well_formed r = true -> keeps r i j a b = true -> forall t, begins r <= t <= ends r ->
  IZR a / IZR b <= norm (sub (position r i t) (position r j t)).
Proof.
  intros W H t Ht; apply keeps_means in H; destruct H as [B [Ri [Rj H]]].
  destruct (distance_at r i j t W Ri Rj Ht) as [k [s [K [Hs ->]]]].
  pose proof (listed_ok r i W Ri) as Bi; pose proof (listed_ok r j W Rj) as Bj.
  unfold has_rows in *; apply Nat.eqb_eq in Ri, Rj.
  pose proof (step_sound _ _ _ k s Bi Bj ltac:(congruence) H ltac:(lia) Hs) as D.
  pose proof (parts_up_sound r a b B); apply well_formed_means in W; destruct W as [_ [U _]].
  set (n := norm _) in *; apply Rmult_le_reg_r with (IZR b * IZR (unit r)); [nra |].
  replace (IZR a / IZR b * (IZR b * IZR (unit r))) with (IZR a * IZR (unit r)) by (field; lra).
  replace (n / IZR (unit r) * (IZR b * IZR (unit r))) with (n * IZR b) by (field; lra); nra.
Qed.
