(** A recorded run as integers, and where its bodies are at every time between its rows.

    `airground prove DIR` writes such a run; DistanceChecker.v and LawChecker.v decide things about it by computing,
    and prove that what they decide is true of the real positions. *)
Require Import Reals Lra Psatz ZArith List Bool Lia.
Require Import Safety.
Import ListNotations.
Local Open Scope Z_scope.

(** * The record: whole numbers of parts; [unit] parts are 1 m, and 1 s *)
Record point := P { px : Z; py : Z; pz : Z }.

(** Where a body is at each of the run's times; from one row to the next it moves by [stride] at most. *)
Record track := Track { stride : Z; places : list point }.

(** Bodies are named by their numbers in the list. *)
Record run := Run { unit : Z; times : list Z; bodies : list track }.

Definition at_rest (rows : nat) (p : point) := Track 0 (repeat p rows).
Definition track_of (r : run) (i : nat) := nth i (bodies r) (Track 0 []).

(** * What it stands for: positions in metres, in straight lines from row to row *)
Local Open Scope R_scope.

(** The way through places [ps] at times [ts]; before the first time and after the last one it has no meaning. *)
Fixpoint path (ts : list R) (ps : list vec) (t : R) : vec :=
  match ts, ps with
  | t0 :: (t1 :: _) as ts', p0 :: (p1 :: _) as ps' =>
      if Rle_dec t t1 then add p0 (scale ((t - t0) / (t1 - t0)) (sub p1 p0)) else path ts' ps' t
  | _, p0 :: _ => p0
  | _, [] => V 0 0 0
  end.

(** Parts as metres or seconds. *)
Definition metres (r : run) (z : Z) := IZR z / IZR (unit r).
Definition place_in (r : run) (p : point) := V (metres r (px p)) (metres r (py p)) (metres r (pz p)).

(** Where body [i] is at time [t], s; m. *)
Definition position (r : run) (i : nat) (t : R) :=
  path (map (metres r) (times r)) (map (place_in r) (places (track_of r i))) t.

Definition begins (r : run) := metres r (hd 0%Z (times r)).
Definition ends (r : run) := metres r (last (times r) 0%Z).

(** * What is computed of every run. Coq's virtual machine evaluates both sides of [&&]: hence [if]. *)
Local Open Scope Z_scope.

Definition minus p q := P (px p - px q) (py p - py q) (pz p - pz q).
Definition product p q := px p * px q + py p * py q + pz p * pz q.

Fixpoint increase (ts : list Z) :=
  match ts with t :: (t' :: _) as ts' => if t <? t' then increase ts' else false | _ => true end.

Fixpoint strides_within (s : Z) (ps : list point) :=
  match ps with
  | p :: (p' :: _) as ps' => let v := minus p' p in if product v v <=? s * s then strides_within s ps' else false
  | _ => true
  end.

Definition track_ok (b : track) := if 0 <=? stride b then strides_within (stride b) (places b) else false.

(** Two rows or more, at increasing times, and strides that are what they say. *)
Definition well_formed (r : run) :=
  if (1 <? length (times r))%nat then if 0 <? unit r then if increase (times r) then forallb track_ok (bodies r)
  else false else false else false.

Definition has_rows (r : run) (i : nat) := (length (places (track_of r i)) =? length (times r))%nat.

(** The run covers the times from [a / b] to [c / d], s. *)
Definition covers (r : run) (a b c d : Z) :=
  if 0 <? b then if 0 <? d then
  if hd 0 (times r) * b <=? a * unit r then c * unit r <=? last (times r) 0 * d
  else false else false else false.

(** A property of all steps: it is given both places before the step and after it. *)
Section Steps.
Variable ok : point -> point -> point -> point -> bool.
Fixpoint all_steps (ps qs : list point) :=
  match ps, qs with
  | p :: (p' :: _) as ps', q :: (q' :: _) as qs' => if ok p p' q q' then all_steps ps' qs' else false
  | _, _ => true
  end.
(** The same of [n] steps alone. *)
Fixpoint some_steps (n : nat) (ps qs : list point) :=
  match n, ps, qs with
  | O, _, _ => true
  | S n', p :: (p' :: _) as ps', q :: (q' :: _) as qs' => if ok p p' q q' then some_steps n' ps' qs' else false
  | _, _, _ => false
  end.
End Steps.

(** [reach] or farther apart; one coordinate that is so large saves the multiplications. *)
Definition is_far (reach : Z) (x : point) :=
  if reach <=? Z.abs (px x) then true else if reach <=? Z.abs (py x) then true else
  if reach <=? Z.abs (pz x) then true else reach * reach <=? product x x.

Ltac split_ifs := repeat match goal with
  | H : (if ?b then _ else false) = true |- _ => destruct b eqn:?; [| discriminate H] end.

(** * Vectors *)
Local Open Scope R_scope.

Definition origin := V 0 0 0.

Lemma scale_sub u x y : sub (scale u x) (scale u y) = scale u (sub x y).
Proof. apply vec_eq; vectors; ring. Qed.

Lemma norm_at_least a x : a * a <= dot x x -> a <= norm x.
Proof.
  intros H; pose proof (norm_nonneg x); pose proof (norm_square x); destruct (Rle_dec a 0); [lra |].
  apply Rsqr_incr_0_var; unfold Rsqr; lra.
Qed.

Lemma norm_at_most a x : 0 <= a -> dot x x <= a * a -> norm x <= a.
Proof. intros A H; pose proof (norm_square x); apply Rsqr_incr_0_var; unfold Rsqr; lra. Qed.

(** * Every time of a path lies on the way from one row to the next *)

(** [s] of the way from row [k] to the next one. *)
Definition on_way ps k s := add (nth k ps origin) (scale s (sub (nth (S k) ps origin) (nth k ps origin))).

Fixpoint increasing ts := match ts with t :: (t' :: _) as ts' => t < t' /\ increasing ts' | _ => True end.

Lemma path_start t0 ts p0 ps : increasing (t0 :: ts) -> path (t0 :: ts) (p0 :: ps) t0 = p0.
Proof.
  destruct ts as [| t1 ts], ps as [| p1 ps]; try reflexivity; simpl; intros [L _].
  destruct Rle_dec; [| lra]; apply vec_eq; vectors; field; lra.
Qed.

Lemma path_rest t0 t1 ts p0 p1 ps t : increasing (t0 :: t1 :: ts) -> t1 <= t ->
  path (t0 :: t1 :: ts) (p0 :: p1 :: ps) t = path (t1 :: ts) (p1 :: ps) t.
Proof.
  intros [L I] H; change (path (t0 :: t1 :: ts) (p0 :: p1 :: ps) t) with
    (if Rle_dec t t1 then add p0 (scale ((t - t0) / (t1 - t0)) (sub p1 p0)) else path (t1 :: ts) (p1 :: ps) t).
  destruct Rle_dec; [| reflexivity]; replace t with t1 by lra; rewrite path_start by exact I.
  apply vec_eq; vectors; field; lra.
Qed.

Lemma increasing_at k : forall ts, increasing ts -> (S k < length ts)%nat -> nth k ts 0 < nth (S k) ts 0.
Proof.
  induction k as [| k IH]; intros [| t0 [| t1 ts]]; simpl length; intros I L; try lia; [exact (proj1 I) |].
  apply (IH (t1 :: ts) (proj2 I)); simpl; lia.
Qed.

Lemma path_between k s : 0 <= s <= 1 -> forall ts ps, increasing ts -> length ps = length ts -> (S k < length ts)%nat ->
  nth 0 ts 0 <= nth k ts 0 /\
  path ts ps (nth k ts 0 + s * (nth (S k) ts 0 - nth k ts 0)) = on_way ps k s.
Proof.
  intros Hs; induction k as [| k IH]; intros [| t0 [| t1 ts]] [| p0 [| p1 ps]]; simpl length; intros I E L; try lia.
  - split; [simpl; lra |]; destruct I as [L01 _]; simpl; destruct Rle_dec as [| N]; [| exfalso; apply N; nra].
    unfold on_way; simpl; apply vec_eq; vectors; field; lra.
  - destruct (IH (t1 :: ts) (p1 :: ps) (proj2 I) ltac:(simpl; lia) ltac:(simpl; lia)) as [F G]; pose proof (proj1 I).
    split; [change (t0 <= nth k (t1 :: ts) 0); change (t1 <= nth k (t1 :: ts) 0) in F; lra |].
    rewrite path_rest; [exact G | exact I |].
    change (nth (S (S k)) (t0 :: t1 :: ts) 0) with (nth (S k) (t1 :: ts) 0).
    change (nth (S k) (t0 :: t1 :: ts) 0) with (nth k (t1 :: ts) 0); change (t1 <= nth k (t1 :: ts) 0) in F.
    assert (U : nth k (t1 :: ts) 0 < nth (S k) (t1 :: ts) 0) by (apply increasing_at; [apply I | simpl; lia]).
    nra.
Qed.

Lemma between_some_rows t : forall ts, increasing ts -> (1 < length ts)%nat -> hd 0 ts <= t <= last ts 0 ->
  exists k s, (S k < length ts)%nat /\ 0 <= s <= 1 /\ t = nth k ts 0 + s * (nth (S k) ts 0 - nth k ts 0).
Proof.
  induction ts as [| t0 [| t1 ts] IH]; simpl length; intros I L H; try lia; destruct I as [L01 I].
  destruct (Rle_dec t t1) as [C | C].
  - exists 0%nat, ((t - t0) / (t1 - t0)); simpl in *; split; [lia |]; split; [| field; lra].
    split; [apply Rle_mult_inv_pos; lra | apply Rmult_le_reg_r with (t1 - t0); [lra | field_simplify; lra]].
  - destruct ts as [| t2 ts]; [simpl in H; lra |].
    destruct (IH I ltac:(simpl; lia)) as [k [s [K [Hs E]]]]; [simpl in *; lra |].
    exists (S k), s; simpl in *; repeat split; [lia | lra | lra | exact E].
Qed.

(** * From integers to real numbers *)

(** A point as a vector, in parts. *)
Definition real p := V (IZR (px p)) (IZR (py p)) (IZR (pz p)).

Lemma real_minus p q : real (minus p q) = sub (real p) (real q).
Proof. unfold real, minus; vectors; rewrite !minus_IZR; reflexivity. Qed.

Lemma real_product p q : IZR (product p q) = dot (real p) (real q).
Proof. unfold product, real; vectors; rewrite !plus_IZR, !mult_IZR; reflexivity. Qed.

Lemma nth_real l k : nth k (map real l) origin = real (nth k l (P 0 0 0)).
Proof. change origin with (real (P 0 0 0)); apply map_nth. Qed.

Ltac to_reals := repeat match goal with
  | H : (_ <=? _)%Z = true |- _ => apply Z.leb_le, IZR_le in H
  | H : (_ <? _)%Z = true |- _ => apply Z.ltb_lt, IZR_lt in H
  | H : (_ <=? _)%Z = false |- _ => apply Z.leb_gt, IZR_lt in H
  | H : (_ =? _)%nat = true |- _ => apply Nat.eqb_eq in H
  end; repeat rewrite ?plus_IZR, ?minus_IZR, ?opp_IZR, ?mult_IZR, ?real_product, ?abs_IZR in *.

Lemma far_sound reach x : is_far reach x = true -> IZR reach <= norm (real x).
Proof.
  assert (C : forall z, IZR reach <= Rabs z -> z * z <= dot (real x) (real x) -> IZR reach <= norm (real x)).
  { intros z Hz Hd; apply Rle_trans with (Rabs z); [exact Hz |].
    apply norm_at_least; rewrite <- Rabs_mult, Rabs_pos_eq; nra. }
  unfold is_far; intros H.
  destruct (_ <=? Z.abs (px x))%Z eqn:?; [to_reals; eapply C; [eassumption | unfold real; vectors; nra] |].
  destruct (_ <=? Z.abs (py x))%Z eqn:?; [to_reals; eapply C; [eassumption | unfold real; vectors; nra] |].
  destruct (_ <=? Z.abs (pz x))%Z eqn:?; [to_reals; eapply C; [eassumption | unfold real; vectors; nra] |].
  to_reals; apply norm_at_least; exact H.
Qed.

Lemma step_at ok k : forall ps qs, all_steps ok ps qs = true -> (S k < length ps)%nat -> length qs = length ps ->
  forall o, ok (nth k ps o) (nth (S k) ps o) (nth k qs o) (nth (S k) qs o) = true.
Proof.
  induction k as [| k IH]; intros [| p [| p' ps]] [| q [| q' qs]]; simpl length; intros H L E o; try lia;
    change ((if ok p p' q q' then all_steps ok (p' :: ps) (q' :: qs) else false) = true) in H; split_ifs.
  - assumption.
  - apply (IH (p' :: ps) (q' :: qs) H); simpl; lia.
Qed.

Lemma some_step_at ok o k : forall n ps qs, some_steps ok n ps qs = true -> (k < n)%nat ->
  ok (nth k ps o) (nth (S k) ps o) (nth k qs o) (nth (S k) qs o) = true.
Proof.
  induction k as [| k IH]; intros [| n] [| p [| p' ps]] [| q [| q' qs]] H L; try lia; try discriminate H.
  all: change ((if ok p p' q q' then some_steps ok n (p' :: ps) (q' :: qs) else false) = true) in H; split_ifs.
  - assumption.
  - apply (IH n (p' :: ps) (q' :: qs) H); lia.
Qed.

Lemma nth_skip (o : point) K k : forall l, nth k (skipn K l) o = nth (K + k) l o.
Proof. induction K as [| K IH]; intros [| p l]; try reflexivity; [destruct k; reflexivity | apply IH]. Qed.

Lemma stride_at s k : (0 <= s)%Z -> forall ps, strides_within s ps = true -> (S k < length ps)%nat ->
  forall o, norm (sub (real (nth (S k) ps o)) (real (nth k ps o))) <= IZR s.
Proof.
  intros Hs; induction k as [| k IH]; intros [| p [| p' ps]]; simpl length; intros H L o; try lia;
    change ((if (product (minus p' p) (minus p' p) <=? s * s)%Z
      then strides_within s (p' :: ps) else false) = true) in H; split_ifs.
  - to_reals; rewrite real_minus in *; apply norm_at_most; [apply IZR_le; lia | assumption].
  - apply (IH (p' :: ps) H); simpl; lia.
Qed.

(** No body moves farther than its stride from a row to the next one. *)
Lemma moves_within b k o : track_ok b = true -> (S k < length (places b))%nat ->
  norm (sub (real (nth (S k) (places b) o)) (real (nth k (places b) o))) <= IZR (stride b).
Proof.
  unfold track_ok; intros H K; split_ifs; apply stride_at; [apply Z.leb_le; assumption | exact H | exact K].
Qed.

(** * The run at any time *)

Lemma well_formed_means r : well_formed r = true ->
  (1 < length (times r))%nat /\ 0 < IZR (unit r) /\ increase (times r) = true /\ forallb track_ok (bodies r) = true.
Proof. unfold well_formed; intros H; split_ifs; to_reals; rewrite Nat.ltb_lt in *; auto. Qed.

Lemma metres_increasing r : 0 < IZR (unit r) -> forall ts, increase ts = true -> increasing (map (metres r) ts).
Proof.
  intros U; induction ts as [| t [| t' ts] IH]; intros H; [exact I | exact I |].
  change ((if (t <? t')%Z then increase (t' :: ts) else false) = true) in H; split_ifs; to_reals.
  split; [unfold metres; apply Rmult_lt_compat_r; [apply Rinv_0_lt_compat |]; assumption | apply IH, H].
Qed.

Lemma on_way_in_metres r l k s : 0 < IZR (unit r) ->
  on_way (map (place_in r) l) k s = scale (/ IZR (unit r)) (on_way (map real l) k s).
Proof.
  intros U; unfold on_way; rewrite !nth_real.
  assert (E : forall m, nth m (map (place_in r) l) origin = scale (/ IZR (unit r)) (real (nth m l (P 0 0 0)))).
  { intros m; assert (O : origin = place_in r (P 0 0 0)).
    { unfold place_in, metres, origin; apply vec_eq; simpl; field; lra. }
    rewrite O, map_nth; unfold place_in, metres, real; apply vec_eq; vectors; field; lra. }
  rewrite !E; apply vec_eq; vectors; ring.
Qed.

(** The difference of two bodies' positions, in parts, [s] of the way from row [k] to the next one. *)
Definition apart_at b c k s := sub (on_way (map real (places b)) k s) (on_way (map real (places c)) k s).

Lemma listed_ok r i : well_formed r = true -> has_rows r i = true -> track_ok (track_of r i) = true.
Proof.
  unfold has_rows, track_of; intros W H; apply well_formed_means in W; destruct W as [L [_ [_ F]]].
  rewrite forallb_forall in F; apply Nat.eqb_eq in H.
  destruct (nth_in_or_default i (bodies r) (Track 0 [])) as [In | D]; [auto | rewrite D in H; simpl in H; lia].
Qed.

(** All bodies are at any time at the same part of their ways from one row to the next. *)
Theorem position_at r t : well_formed r = true -> begins r <= t <= ends r ->
  exists k s, (S k < length (times r))%nat /\ 0 <= s <= 1 /\ forall i, has_rows r i = true ->
  position r i t = scale (/ IZR (unit r)) (on_way (map real (places (track_of r i))) k s).
Proof.
  intros W H; apply well_formed_means in W; destruct W as [L [U [I _]]]; pose proof (metres_increasing r U _ I) as M.
  assert (E : hd 0 (map (metres r) (times r)) = begins r /\ last (map (metres r) (times r)) 0 = ends r).
  { unfold begins, ends; destruct (times r) as [| a l]; [simpl in L; lia |]; split; [reflexivity |].
    clear; revert a; induction l as [| b l IH]; intros a; [reflexivity | apply (IH b)]. }
  destruct (between_some_rows t _ M) as [k [s [K [Hs T]]]]; [rewrite map_length; exact L | lra |].
  rewrite map_length in K; exists k, s; repeat split; [exact K | lra | lra |].
  unfold has_rows; intros a La; apply Nat.eqb_eq in La; rewrite <- on_way_in_metres, T by assumption; unfold position.
  apply (path_between k s Hs); [exact M | rewrite !map_length; exact La | rewrite map_length; exact K].
Qed.

Corollary difference_at r i j t : well_formed r = true -> has_rows r i = true -> has_rows r j = true ->
  begins r <= t <= ends r -> exists k s, (S k < length (times r))%nat /\ 0 <= s <= 1 /\
  sub (position r i t) (position r j t) = scale (/ IZR (unit r)) (apart_at (track_of r i) (track_of r j) k s).
Proof.
  intros W Hi Hj H; destruct (position_at r t W H) as [k [s [K [Hs P]]]]; exists k, s; repeat split;
    [exact K | lra | lra |].
  rewrite !P by assumption; apply scale_sub.
Qed.

Lemma covers_sound r a b c d t : well_formed r = true -> covers r a b c d = true ->
  IZR a / IZR b <= t <= IZR c / IZR d -> begins r <= t <= ends r.
Proof.
  unfold covers, begins, ends, metres; intros W H [A C].
  apply well_formed_means in W; destruct W as [_ [U _]]; split_ifs; to_reals.
  assert (F : forall x y u v, 0 < u -> 0 < v -> x * v <= y * u -> x / u <= y / v).
  { intros x y u v P Q L; apply Rmult_le_reg_r with (u * v); [nra |].
    replace (x / u * (u * v)) with (x * v) by (field; lra).
    replace (y / v * (u * v)) with (y * u) by (field; lra); exact L. }
  split; [eapply Rle_trans; [apply F | exact A] | eapply Rle_trans; [exact C | apply F]]; assumption.
Qed.

(** THEOREM: Positions within r and q of those of the run lose at most r + q of a distance.
    - Recorded positions differ from the exported ones by their rounding. *)
Theorem nearby (u v u' v' : vec) (r q d : R) : norm (sub u' u) <= r -> norm (sub v' v) <= q -> d <= norm (sub u v) ->
  d - r - q <= norm (sub u' v').
Proof.
  intros U W D; pose proof (norm_difference (sub u' v') (sub (sub u' u) (sub v' v))) as T.
  pose proof (norm_difference (sub u' u) (sub v' v)).
  replace (sub (sub u' v') (sub (sub u' u) (sub v' v))) with (sub u v) in T by (apply vec_eq; vectors; ring); lra.
Qed.
