(** Whether a recorded run keeps a distance at all times: decided exactly, from positions alone. *)
Require Import Reals Lra Psatz ZArith List Bool Lia.
Require Import Safety Convex Run.
Import ListNotations.
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
  let u := track_of r i in let v := track_of r j in
  if 0 <? b then if has_rows r i then if has_rows r j then
  all_steps (step_keeps (parts_up r a b) (stride u + stride v)) (places u) (places v)
  else false else false else false.

(** ** A body and convex sets that move with another body: hulls of corners

    A vector [n] separates a body from a set: the body is beyond the plane [n . x = least], [d] or more from every
    corner along [n]. A proof is a list of such vectors, each with the number of periods that it serves. *)
Definition root (d : Z) (n : point) := Z.max 1 (Z.sqrt_up (d * d * product n n)).

Definition furthest (n : point) (corners : list point) :=
  fold_right (fun c most => Z.max (product n c) most) (product n (hd (P 0 0 0) corners)) corners.

Definition least_of d corners n := furthest n corners + root d n.

(** By how much the body is beyond the plane. *)
Definition excess (n : point) (least : Z) (p q : point) := product n (minus p q) - least.

(** For how many rows an excess [e] lasts that shrinks by [cost] at most in each; 0 where it is not worth dividing. *)
Definition lasts (e cost : Z) := if e <? 32 * cost then O else Z.to_nat (Z.min (e / cost) 4096).

(** [n] serves [more] periods more, and then those of [vectors]. In a period both bodies move by [reach] at most in all,
    so that the excess shrinks by [cost] at most: at the next [sure] rows it is not below 0 and need not be known. *)
Fixpoint separate d reach corners (n : point) (least cost : Z) (sure more : nat) (vectors : list (Z * point)) ps qs :=
  match ps, qs with
  | p :: ps', q :: qs' =>
      match sure, more with
      | S sure', S more' => separate d reach corners n least cost sure' more' vectors ps' qs'
      | _, _ =>
        let e := excess n least p q in
        if 0 <=? e then
          match ps', more, vectors with
          | [], _, _ => true
          | _, S more', _ => separate d reach corners n least cost (lasts e cost) more' vectors ps' qs'
          | _, O, (periods, n') :: vectors' =>
              let least := least_of d corners n' in
              let cost := root reach n' in
              let e := excess n' least p q in
              if 0 <=? e then
                separate d reach corners n' least cost (lasts e cost) (pred (Z.to_nat periods)) vectors' ps' qs'
              else false
          | _, O, [] => false
          end
        else false
      end
  | _, _ => false
  end.

(** [sets] are lists of corners, and [proofs] has one for each. *)
Fixpoint separate_all d reach (sets : list (list point)) (proofs : list (list (Z * point))) ps qs :=
  match sets, proofs with
  | [], _ => true
  | corners :: sets', ((periods, n) :: vectors) :: proofs' =>
      if separate d reach corners n (least_of d corners n) (root reach n) O (Z.to_nat periods) vectors ps qs
      then separate_all d reach sets' proofs' ps qs else false
  | _, _ => false
  end.

(** Track [i] keeps [a / b] metres from the hulls of [sets], which move with body [j]. *)
Definition keeps_clear (r : run) (i j : nat) sets (a b : Z) proofs :=
  let u := track_of r i in let v := track_of r j in
  if 0 <? b then if has_rows r i then if has_rows r j then
  separate_all (parts_up r a b) (stride u + stride v) sets proofs (places u) (places v)
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

Lemma step_sound d b c k s : track_ok b = true -> track_ok c = true -> length (places c) = length (places b) ->
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
  all_steps (step_keeps (parts_up r a b) (stride (track_of r i) + stride (track_of r j)))
    (places (track_of r i)) (places (track_of r j)) = true.
Proof. unfold keeps; intros H; split_ifs; to_reals; auto. Qed.

Lemma parts_up_sound r a b : 0 < IZR b -> IZR a * IZR (unit r) <= IZR (parts_up r a b) * IZR b.
Proof.
  intros B; apply lt_IZR in B; rewrite <- !mult_IZR; apply IZR_le; unfold parts_up.
  pose proof (Z.mul_div_le (- (a * unit r)) b B); lia.
Qed.

(** THEOREM (7)-(8), (11): Two bodies of a recorded run that the checker accepts keep their distance at all times of the
    run.
    - The integers in the file are the recorded positions, rounded to 2^-60 m.
    - Between two rows bodies move on straight lines. *)
Theorem sound r i j a b : well_formed r = true -> keeps r i j a b = true -> forall t, begins r <= t <= ends r ->
  IZR a / IZR b <= norm (sub (position r i t) (position r j t)).
Proof.
  intros W H t Ht; apply keeps_means in H; destruct H as [B [Ri [Rj H]]].
  destruct (difference_at r i j t W Ri Rj Ht) as [k [s [K [Hs ->]]]].
  pose proof (listed_ok r i W Ri) as Bi; pose proof (listed_ok r j W Rj) as Bj.
  unfold has_rows in *; apply Nat.eqb_eq in Ri, Rj.
  pose proof (step_sound _ _ _ k s Bi Bj ltac:(congruence) H ltac:(lia) Hs) as D.
  pose proof (parts_up_sound r a b B); apply well_formed_means in W; destruct W as [_ [U _]].
  rewrite norm_scale by apply Rlt_le, Rinv_0_lt_compat, U; set (n := norm _) in *.
  apply Rmult_le_reg_r with (IZR b * IZR (unit r)); [nra |].
  replace (IZR a / IZR b * (IZR b * IZR (unit r))) with (IZR a * IZR (unit r)) by (field; lra).
  replace (/ IZR (unit r) * n * (IZR b * IZR (unit r))) with (n * IZR b) by (field; lra); nra.
Qed.

(** * A body and convex sets *)

(** At the time [t] body [i] is [d] or more from every point of the hulls of [sets], which move with body [j]; m. *)
Definition clear (r : run) (i j : nat) (sets : list (list point)) (d t : R) := forall corners c, In corners sets ->
  hull (map (place_in r) corners) c -> d <= norm (sub (position r i t) (add (position r j t) c)).

Lemma clear_less r i j sets d e t : e <= d -> clear r i j sets d t -> clear r i j sets e t.
Proof. intros L H corners c I C; specialize (H corners c I C); lra. Qed.

Lemma furthest_is n corners c : In c corners -> (product n c <= furthest n corners)%Z.
Proof.
  unfold furthest; generalize (product n (hd (P 0 0 0) corners)); intros m; induction corners as [| e corners IH].
  - intros [].
  - intros [-> | In]; simpl; [| specialize (IH In)]; lia.
Qed.

Lemma root_sound d n : 1 <= IZR (root d n) /\ IZR d * norm (real n) <= IZR (root d n).
Proof.
  assert (R : (1 <= root d n)%Z) by (unfold root; lia); split; [apply IZR_le, R |].
  assert (Q : (d * d * product n n <= root d n * root d n)%Z).
  { unfold root; destruct (Z_le_gt_dec (d * d * product n n) 0) as [L | G]; [nia |].
    pose proof (Z.sqrt_up_spec _ (Z.gt_lt _ _ G)); pose proof (Z.sqrt_up_nonneg (d * d * product n n)); nia. }
  apply IZR_le in R, Q; rewrite !mult_IZR, real_product, <- norm_square in Q.
  apply Rsqr_incr_0_var; [unfold Rsqr; nra | lra].
Qed.

Definition separates d corners n p q := (0 <= excess n (least_of d corners n) p q)%Z.

Lemma excess_after reach n least p q p' q' : norm (sub (real (minus p' q')) (real (minus p q))) <= IZR reach ->
  (excess n least p q - root reach n <= excess n least p' q')%Z.
Proof.
  intros H; unfold excess; apply le_IZR; rewrite !minus_IZR, !real_product.
  pose proof (dot_le (real n) (sub (real (minus p' q')) (real (minus p q)))) as C.
  destruct (root_sound reach n) as [_ R].
  replace (dot (real n) (sub _ _)) with (dot (real n) (real (minus p' q')) - dot (real n) (real (minus p q))) in C
    by (vectors; ring); pose proof (norm_nonneg (real n)); nra.
Qed.

(** What is known at a row where [sure] rows are left. *)
Definition known cost sure e := match sure with O => True | S k => (Z.of_nat k * cost <= e)%Z end.

Lemma lasts_known e e' cost : (0 < cost)%Z -> (0 <= e)%Z -> (e - cost <= e')%Z -> known cost (lasts e cost) e'.
Proof.
  intros C E L; unfold lasts; destruct (_ <? _)%Z; [exact I |]; pose proof (Z.mul_div_le e cost C).
  set (m := Z.min _ _); unfold known; destruct (Z.to_nat m) as [| k] eqn:K; [exact I |].
  assert (Z.of_nat k + 1 <= e / cost)%Z by lia; nia.
Qed.

(** In a period both bodies move by [reach] at most in all. *)
Definition moves_by reach ps qs o := forall k, (S k < length ps)%nat ->
  norm (sub (real (minus (nth (S k) ps o) (nth (S k) qs o))) (real (minus (nth k ps o) (nth k qs o)))) <= IZR reach.

Lemma root_positive d n : (0 < root d n)%Z.
Proof. unfold root; lia. Qed.

Lemma separate_first d reach corners o ps qs n sure more vectors :
  known (root reach n) sure (excess n (least_of d corners n) (nth 0 ps o) (nth 0 qs o)) ->
  separate d reach corners n (least_of d corners n) (root reach n) sure more vectors ps qs = true ->
  separates d corners n (nth 0 ps o) (nth 0 qs o).
Proof.
  destruct ps as [| p ps], qs as [| q qs]; intros N H; try discriminate H; cbn [separate] in H; cbn [nth] in *.
  unfold separates; destruct sure as [| sure], more as [| more]; simpl known in N.
  1, 2, 3: split_ifs; apply Z.leb_le; assumption.
  pose proof (root_positive reach n); nia.
Qed.

(** In every period there is a vector that separates the two at both of its ends. *)
Lemma separate_means d reach corners o k : forall ps qs n sure more vectors, moves_by reach ps qs o ->
  known (root reach n) sure (excess n (least_of d corners n) (nth 0 ps o) (nth 0 qs o)) ->
  separate d reach corners n (least_of d corners n) (root reach n) sure more vectors ps qs = true ->
  (S k < length ps)%nat -> exists n',
  separates d corners n' (nth k ps o) (nth k qs o) /\ separates d corners n' (nth (S k) ps o) (nth (S k) qs o).
Proof.
  induction k as [| k IH]; intros [| p ps] [| q qs] n sure more vectors T N H K; try (simpl in K; lia);
    try discriminate H.
  all: pose proof (separate_first _ _ _ o _ _ _ _ _ _ N H) as H0; cbn [separate] in H; cbn [nth] in N, H0.
  all: destruct ps as [| p' ps]; [simpl in K; lia |].
  all: assert (A : forall m, (excess m (least_of d corners m) p q - root reach m <=
    excess m (least_of d corners m) (nth 0 (p' :: ps) o) (nth 0 qs o))%Z)
    by (intros; apply excess_after, (T 0%nat); simpl; lia).
  all: assert (T' : moves_by reach (p' :: ps) qs o) by (intros l Hl; apply (T (S l)); simpl in *; lia).
  all: assert (M : exists n' sure' more' vectors', separates d corners n' p q /\
    known (root reach n') sure' (excess n' (least_of d corners n') (nth 0 (p' :: ps) o) (nth 0 qs o)) /\
    separate d reach corners n' (least_of d corners n') (root reach n') sure' more' vectors' (p' :: ps) qs = true).
  1, 3: pose proof (root_positive reach n) as C; destruct sure as [| sure], more as [| more]; cbv match in H; split_ifs;
    try (destruct vectors as [| [m n'] vectors]; try discriminate H; cbv match in H; split_ifs;
      exists n', (lasts (excess n' (least_of d corners n') p q) (root reach n')), (pred (Z.to_nat m)), vectors;
      repeat split; [| | exact H]; [apply Z.leb_le; assumption |];
      apply lasts_known with (3 := A n'); [apply root_positive | apply Z.leb_le; assumption]).
  1, 3: exists n, (lasts (excess n (least_of d corners n) p q) (root reach n)), more, vectors; repeat split;
    [exact H0 | apply lasts_known with (3 := A n); assumption | exact H].
  1, 2: exists n, sure, more, vectors; repeat split; [exact H0 | | exact H]; simpl known in N; specialize (A n);
    destruct sure; [exact I | rewrite Nat2Z.inj_succ, Z.mul_succ_l in N; unfold known; lia].
  all: destruct M as [n' [sure' [more' [vectors' [M0 [M1 M2]]]]]].
  - exists n'; split; [exact M0 | exact (separate_first _ _ _ o (p' :: ps) qs _ _ _ _ M1 M2)].
  - refine (IH (p' :: ps) qs _ _ _ _ T' M1 M2 _); simpl in *; lia.
Qed.

Lemma separated d corners n b c k s e : 0 <= s <= 1 -> In e corners ->
  separates d corners n (nth k (places b) (P 0 0 0)) (nth k (places c) (P 0 0 0)) ->
  separates d corners n (nth (S k) (places b) (P 0 0 0)) (nth (S k) (places c) (P 0 0 0)) ->
  dot (real n) (real e) + IZR (root d n) <= dot (real n) (apart_at b c k s).
Proof.
  intros Hs E S0 S1; apply (furthest_is n) in E; unfold separates, excess, least_of in S0, S1.
  unfold apart_at, on_way; rewrite !nth_real.
  assert (A : forall x, (0 <= product n x - (furthest n corners + root d n))%Z ->
    dot (real n) (real e) + IZR (root d n) <= dot (real n) (real x)).
  { intros x Hx; rewrite <- !real_product, <- plus_IZR; apply IZR_le; lia. }
  apply A in S0, S1; rewrite real_minus in S0, S1; set (least := _ + _) in *.
  set (w := real n) in *; set (p := real (nth k _ _)) in *; set (q := real (nth k (places c) _)) in *.
  set (p' := real (nth (S k) (places b) _)) in *; set (q' := real (nth (S k) (places c) _)) in *.
  replace (dot w _) with ((1 - s) * dot w (sub p q) + s * dot w (sub p' q')) by (vectors; ring); nra.
Qed.

Lemma separate_each d reach corners ps qs : forall sets proofs,
  separate_all d reach sets proofs ps qs = true -> In corners sets -> exists n more vectors,
  separate d reach corners n (least_of d corners n) (root reach n) O more vectors ps qs = true.
Proof.
  induction sets as [| first sets IH]; intros [| [| [m n] vectors] proofs] H I; try discriminate H; destruct I.
  all: cbn [separate_all] in H; split_ifs; subst; eauto.
Qed.

(** THEOREM (7)-(8), (11): A body that the checker accepts keeps its distance from convex sets that move without
    turning, at all times.
    - The hypotheses of DistanceChecker.sound.
    - The corners in the file are those of the scenario, rounded to 2^-60 m; the sets do not turn. *)
Theorem sets_sound r i j sets a b proofs : well_formed r = true -> keeps_clear r i j sets a b proofs = true ->
  forall t, begins r <= t <= ends r -> clear r i j sets (IZR a / IZR b) t.
Proof.
  unfold keeps_clear; intros W H t Ht corners c I Hc; split_ifs; apply Z.ltb_lt, IZR_lt in Heqb0.
  destruct (difference_at r i j t W Heqb1 Heqb2 Ht) as [k [s [Hk [Hs E]]]].
  pose proof (listed_ok r i W Heqb1) as Bi; pose proof (listed_ok r j W Heqb2) as Bj.
  unfold has_rows in Heqb1, Heqb2; apply Nat.eqb_eq in Heqb1, Heqb2.
  destruct (separate_each _ _ _ _ _ _ _ H I) as [first [more [vectors K]]].
  assert (T : moves_by (stride (track_of r i) + stride (track_of r j)) (places (track_of r i)) (places (track_of r j))
    (P 0 0 0)).
  { intros l Hl; pose proof (moves_within _ l (P 0 0 0) Bi ltac:(lia)) as A.
    pose proof (moves_within _ l (P 0 0 0) Bj ltac:(lia)) as B; rewrite plus_IZR, !real_minus.
    eapply Rle_trans; [| apply Rplus_le_compat; [exact A | exact B]].
    eapply Rle_trans; [| apply norm_difference]; right; f_equal; apply vec_eq; vectors; ring. }
  destruct (separate_means _ _ _ _ k _ _ first O _ _ T Logic.I K ltac:(lia)) as [n [S0 S1]].
  clear T.
  apply well_formed_means in W; destruct W as [_ [U _]]; set (u := IZR (unit r)) in *.
  set (x := apart_at (track_of r i) (track_of r j) k s) in *; set (w := real n); set (d := parts_up r a b) in *.
  assert (Iu : 0 < / u) by apply Rinv_0_lt_compat, U.
  destruct (root_sound d n) as [R1 Rd]; fold w in Rd; set (rt := IZR (root d n)) in *.
  assert (B : dot w c <= / u * (dot w x - rt)).
  { apply (at_corners _ w _) with (2 := Hc); intros c' Hc'; apply in_map_iff in Hc'; destruct Hc' as [e [<- He]].
    replace (dot w (place_in r e)) with (/ u * dot w (real e))
      by (unfold place_in, metres, real, Rdiv; fold u; vectors; ring).
    apply Rmult_le_compat_l; [lra |]; pose proof (separated d corners n _ _ k s e Hs He S0 S1).
    fold w rt x in H0; lra. }
  set (v := sub (position r i t) (add (position r j t) c)).
  assert (V : / u * rt <= norm w * norm v).
  { apply Rle_trans with (2 := proj2 (dot_le w v)).
    replace v with (sub (scale (/ u) x) c) by (unfold v; rewrite <- E; vectors; f_equal; ring).
    replace (dot w (sub (scale (/ u) x) c)) with (/ u * dot w x - dot w c) by (vectors; ring); lra. }
  pose proof (norm_nonneg w); pose proof (norm_nonneg v).
  assert (Q : IZR d <= u * norm v).
  { assert (0 < norm w) by nra; apply Rmult_le_reg_l with (norm w); [assumption |].
    apply (Rmult_le_compat_l u) in V; [| lra]; rewrite <- Rmult_assoc, Rinv_r, Rmult_1_l in V by lra; lra. }
  pose proof (parts_up_sound r a b Heqb0) as A; fold d u in A.
  apply Rmult_le_reg_r with (IZR b * u); [nra |].
  replace (IZR a / IZR b * (IZR b * u)) with (IZR a * u) by (field; lra); nra.
Qed.
