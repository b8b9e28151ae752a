(** Two robots that act on old positions of each other, decide at instants of their own, with periods that may vary.

    Half shares of the excess [D - d] are not enough: see [half_shares_fail].
    What is enough: a robot looks at where the other one can be *until that one decides again*, its [danger], a set.
    Here it is the ball about a position that the other one had once; its radius [rho] is the speed limit of the other
    times the age of that position and the other's longest period. The law, per robot, with [H] its own longest period:
      [n.u >= - (D - d - rho) / H] where [D >= d + rho], otherwise [D n.u >= rho |u|], as standing does.
    No clock is compared, no share is agreed on, and nothing is said about which messages arrive.
    [e] is by how much a decision misses the law, m: of that, nothing is ever restored. *)
Require Import Reals Lra Psatz Lia Safety.
Local Open Scope R_scope.

(** ** Half shares: period 1, robots at 0, 1, ... and 1/2, 3/2, ... on a line, an excess of 1 at the start; each uses up
    half of the excess that it sees. After two periods the distance is [d - 11/256]. *)
(** THEOREM: Half shares are not enough for robots whose samples are half a period apart: they end inside d. *)
Theorem half_shares_fail d D0 D1 D2 D3 D4 a a' b b' :
  D0 = d + 1 -> a = (D0 - d) / 2 (* the first robot decides at 0 *) -> D1 = D0 - a / 2 ->
  b = (D1 - d) / 2 (* the second one at 1/2; it was at rest *) -> D2 = D1 - (a + b) / 2 ->
  a' = (D2 - d) / 2 (* the first one at 1 *) -> D3 = D2 - (a' + b) / 2 ->
  b' = (D3 - d) / 2 (* the second one at 3/2 *) -> D4 = D3 - (a' + b') / 2 -> D4 = d - 11 / 256.
Proof. lra. Qed.

(** * The law *)

(** A robot at [x] may move at [u] for its longest period [H], up to [e] metres; [m] is what is kept in any case. *)
Definition advances d H e x u (danger : vec -> Prop) := exists n D,
  norm n = 1 /\ d <= D /\ (forall b, danger b -> D <= dot n (sub x b)) /\ - (D - d + e) / H <= dot n u.
Definition retreats m H e x u (danger : vec -> Prop) := forall b, danger b -> - (m * e / H) <= dot (sub x b) u.
Definition allowed d m H e x u danger := advances d H e x u danger \/ retreats m H e x u danger.

Lemma allowed_keeps d m H e x u danger b c s : 0 < H -> 0 <= e -> 0 < m <= c -> c <= d -> allowed d m H e x u danger ->
  danger b -> 0 <= s <= H -> c <= norm (sub x b) -> c - e <= norm (sub (add x (scale s u)) b).
Proof.
  intros HH He Hm Hc [[n [D [U [HD [S L]]]]] | R] Hb Hs H0.
  - specialize (S b Hb); apply Rle_trans with (2 := unit_dot n _ U).
    replace (dot n (sub (add x (scale s u)) b)) with (dot n (sub x b) + s * dot n u)
      by (unfold dot, sub, add, scale; simpl; ring).
    assert (Q : s * (- (D - d + e) / H) <= s * dot n u) by (apply Rmult_le_compat_l; lra).
    assert (P : s * (- (D - d + e) / H) = - (D - d + e) + (D - d + e) * (1 - s / H)) by (field; lra).
    assert (0 <= (D - d + e) * (1 - s / H)).
    { apply Rmult_le_pos; [lra |]; apply Rmult_le_reg_r with H; [lra |]; field_simplify; lra. }
    lra.
  - specialize (R b Hb); set (r := norm (sub x b)) in *.
    assert (K : along (scale (/ r) (sub x b)) (sub x b)) by (apply along_unit; fold r; lra).
    pose proof (grows _ _ (sub (add x (scale s u)) b) K) as G; fold r in G; apply Rle_trans with (2 := G).
    replace (dot (scale (/ r) (sub x b)) (sub (sub (add x (scale s u)) b) (sub x b)))
      with (s * (/ r * dot (sub x b) u)) by (unfold dot, sub, add, scale; simpl; ring).
    assert (I : 0 < / r) by (apply Rinv_0_lt_compat; lra).
    assert (- (m * e / H) * / r <= / r * dot (sub x b) u) by (rewrite Rmult_comm; apply Rmult_le_compat_l; lra).
    assert (Q : s * (- (m * e / H) * / r) <= s * (/ r * dot (sub x b) u)) by (apply Rmult_le_compat_l; lra).
    assert (m * / r <= 1) by (apply Rmult_le_reg_r with r; [lra |]; rewrite Rmult_assoc, Rinv_l; lra).
    assert (s / H <= 1) by (apply Rmult_le_reg_r with H; [lra |]; unfold Rdiv; rewrite Rmult_assoc, Rinv_l; lra).
    assert (0 <= s / H) by (apply Rmult_le_pos; [lra | left; apply Rinv_0_lt_compat; lra]).
    assert (0 <= m * / r) by (apply Rmult_le_pos; lra).
    assert (s / H * (m * / r) <= 1) by nra.
    assert (e * (s / H * (m * / r)) <= e * 1) by (apply Rmult_le_compat_l; lra).
    replace (s * (- (m * e / H) * / r)) with (- (e * (s / H * (m * / r)))) in Q by (field; split; lra).
    lra.
Qed.

(** What all decisions up to one have missed. *)
Fixpoint total (e : nat -> R) k := match k with O => e O | S k => total e k + e (S k) end.

Section Pair.

Variables d E H1 H2 : R.
Hypotheses (H1_positive : 0 < H1) (H2_positive : 0 < H2) (something_left : E < d).
(** Where the robots (the points that the law steers) are, the instants at which they decide, their commands. *)
Variables (z1 z2 : R -> vec) (T1 T2 : nat -> R) (u1 u2 : nat -> vec).
Variables (e1 e2 : nat -> R) (danger1 danger2 : nat -> vec -> Prop).
Hypotheses (first1 : T1 0%nat = 0) (first2 : T2 0%nat = 0).
Hypothesis next1 : forall k, T1 k < T1 (S k) <= T1 k + H1.
Hypothesis next2 : forall k, T2 k < T2 (S k) <= T2 k + H2.
Hypothesis go_on1 : forall t, exists k, t < T1 k.
Hypothesis go_on2 : forall t, exists k, t < T2 k.
Hypothesis held1 : forall k t, T1 k <= t <= T1 (S k) -> z1 t = add (z1 (T1 k)) (scale (t - T1 k) (u1 k)).
Hypothesis held2 : forall k t, T2 k <= t <= T2 (S k) -> z2 t = add (z2 (T2 k)) (scale (t - T2 k) (u2 k)).
(** The danger of a decision: all the places where the other one is until it decides again. Where both decide at one
    instant, one must reckon with the new command of the other; at the start the first one must know where that is. *)
Hypothesis reckons1 : forall k l t, T2 l < T1 k <= T2 (S l) -> T1 k <= t <= T2 (S l) -> danger1 k (z2 t).
Hypothesis reckons2 : forall k l t, T1 k <= T2 l < T1 (S k) -> T2 l <= t <= T1 (S k) -> danger2 l (z1 t).
Hypothesis knows_start : danger1 0%nat (z2 0).
Hypotheses (missed1 : forall k, 0 <= e1 k) (missed2 : forall k, 0 <= e2 k).
Hypothesis in_all : forall k l, total e1 k + total e2 l <= E.
Hypothesis law1 : forall k, allowed d (d - E) H1 (e1 k) (z1 (T1 k)) (u1 k) (danger1 k).
Hypothesis law2 : forall k, allowed d (d - E) H2 (e2 k) (z2 (T2 k)) (u2 k) (danger2 k).
Hypothesis start : d <= norm (sub (z1 0) (z2 0)).

Let lost k l := total e1 k + total e2 l.

Lemma after1 k : 0 <= T1 k.
Proof. induction k as [| k IH]; [lra | pose proof (next1 k); lra]. Qed.

Lemma after2 l : 0 <= T2 l.
Proof. induction l as [| l IH]; [lra | pose proof (next2 l); lra]. Qed.

Lemma total_nonneg e k : (forall k, 0 <= e k) -> 0 <= total e k.
Proof. intros P; induction k as [| k IH]; simpl; [apply P | specialize (P (S k)); lra]. Qed.

(** A decision of either robot loses what it misses of what there was. *)
Lemma first_moves k t b c : T1 k <= t <= T1 (S k) -> danger1 k b -> d - E <= c <= d ->
  c <= norm (sub (z1 (T1 k)) b) -> c - e1 k <= norm (sub (z1 t) b).
Proof.
  intros Ht Hb Hc H0; pose proof (next1 k); rewrite (held1 k t Ht).
  apply (allowed_keeps d (d - E) H1 (e1 k) _ _ (danger1 k)); auto; lra.
Qed.

Lemma second_moves l t b c : T2 l <= t <= T2 (S l) -> danger2 l b -> d - E <= c <= d ->
  c <= norm (sub b (z2 (T2 l))) -> c - e2 l <= norm (sub b (z2 t)).
Proof.
  intros Ht Hb Hc H0; pose proof (next2 l); rewrite norm_sym in H0 |- *; rewrite (held2 l t Ht).
  apply (allowed_keeps d (d - E) H2 (e2 l) _ _ (danger2 l)); auto; lra.
Qed.

Lemma left_over k l : d - E <= d - lost k l <= d.
Proof.
  pose proof (in_all k l); pose proof (total_nonneg e1 k missed1); pose proof (total_nonneg e2 l missed2).
  unfold lost; lra.
Qed.

(** The second one moves from where the first one knows it to be. *)
Lemma at_start t t' : 0 <= t <= T1 1%nat -> 0 <= t' <= T2 1%nat ->
  d - lost 0 0 <= norm (sub (z1 t) (z2 t')).
Proof.
  intros Ht Ht'; pose proof (left_over 0 0) as L; pose proof (missed1 0%nat); pose proof (missed2 0%nat).
  pose proof (next1 0%nat); unfold lost in *; simpl in *; rewrite first1 in *.
  replace (d - (e1 0%nat + e2 0%nat)) with (d - e1 0%nat - e2 0%nat) by ring.
  apply second_moves; rewrite ?first2; [lra | apply (reckons2 0%nat 0%nat); rewrite ?first1, ?first2; lra | lra |].
  apply first_moves; rewrite ?first1; [lra | exact knows_start | lra | exact start].
Qed.

(** What has been decided is safe whenever the two carry it out. *)
Lemma decided : forall N k l, (k + l <= N)%nat ->
  (T2 l < T1 k <= T2 (S l) -> forall t t', T1 k <= t <= T1 (S k) -> T1 k <= t' <= T2 (S l) ->
    d - lost k l <= norm (sub (z1 t) (z2 t')))
  /\ (T1 k <= T2 l < T1 (S k) -> forall t t', T2 l <= t <= T1 (S k) -> T2 l <= t' <= T2 (S l) ->
    d - lost k l <= norm (sub (z1 t) (z2 t'))).
Proof.
  induction N as [| N IH]; intros k l HN; split; intros O t t' Ht Ht'.
  1, 3: (* the first one decides later *)
    (destruct k as [| k]; [pose proof (after2 l); lra |]); try lia; (
    replace (d - lost (S k) l) with (d - lost k l - e1 (S k)) by (unfold lost; simpl; ring);
    apply first_moves; [lra | apply (reckons1 (S k) l); lra | apply left_over |];
    pose proof (next1 k); destruct (Rle_dec (T1 k) (T2 l)) as [A | A];
    [apply (proj2 (IH k l ltac:(lia))) | apply (proj1 (IH k l ltac:(lia)))]; lra).
  - assert (k = 0%nat /\ l = 0%nat) as [-> ->] by lia; apply at_start; rewrite ?first2 in *; lra.
  - destruct l as [| l].
    + destruct k as [| k]; [| pose proof (next1 k); pose proof (after1 k); lra].
      apply at_start; rewrite ?first2 in *; lra.
    + replace (d - lost k (S l)) with (d - lost k l - e2 (S l)) by (unfold lost; simpl; ring).
      apply second_moves; [lra | apply (reckons2 k (S l)); lra | apply left_over |].
      pose proof (next2 l); destruct (Rlt_dec (T2 l) (T1 k)) as [A | A];
      [apply (proj1 (IH k l ltac:(lia))) | apply (proj2 (IH k l ltac:(lia)))]; lra.
Qed.

Lemma during (T : nat -> R) t : T 0%nat = 0 -> (exists k, t < T k) -> 0 <= t -> exists k, T k <= t < T (S k).
Proof.
  intros Z [k Hk] Ht; induction k as [| k IH]; [lra |].
  destruct (Rlt_dec t (T k)) as [L | L]; [apply IH, L | exists k; lra].
Qed.

(** ** At all times the distance is [d] but for what was missed in all *)

(** THEOREM: Two robots that decide at instants of their own keep d, if each keeps off where the other can be until that
    one decides again.
    - Between its decisions, at most H apart, a robot moves straight at its command.
    - Each decision meets the law towards its danger: every place of the other one until that one decides again.
    - The first one knows where the second one starts.
    - They start at d or farther.
    Silent on: How a pair gets out of d: what its decisions miss is lost for good, and is their sum. *)
Theorem asynchronous t : 0 <= t -> d - E <= norm (sub (z1 t) (z2 t)).
Proof.
  intros Ht; destruct (during T1 t first1 (go_on1 t) Ht) as [k Hk].
  destruct (during T2 t first2 (go_on2 t) Ht) as [l Hl].
  apply Rle_trans with (d - lost k l); [apply left_over |].
  destruct (Rlt_dec (T2 l) (T1 k)) as [L | L].
  - apply (proj1 (decided (k + l) k l (le_n _))); lra.
  - apply (proj2 (decided (k + l) k l (le_n _))); lra.
Qed.

End Pair.

(** * The law towards an old position: [w] is the place of the robot as seen from there *)

Definition keeps_off d m H rho e w u := u = V 0 0 0 \/ exists n, along n w /\
  ((d + rho <= norm w /\ - (norm w - d - rho + e) / H <= dot n u) \/ rho * norm u - m * e / H <= norm w * dot n u).

(** THEOREM: The law towards an old position keeps a robot off all places within rho of that position.
    - The period is positive. *)
Lemma towards_old d m H rho e x y u : 0 < H -> 0 <= m -> 0 <= e -> keeps_off d m H rho e (sub x y) u ->
  allowed d m H e x u (fun b => norm (sub b y) <= rho).
Proof.
  intros HH Hm He L.
  assert (0 <= m * e / H) by (apply Rmult_le_pos; [apply Rmult_le_pos; lra | left; apply Rinv_0_lt_compat; lra]).
  destruct L as [-> | [n [[U X] L]]].
  { right; intros b _; unfold dot; simpl; lra. }
  set (w := sub x y) in *.
  assert (N : forall b, sub x b = sub w (sub b y)) by (intros b; unfold w, sub; destruct x, b, y; simpl; f_equal; ring).
  assert (NN : dot n n = 1) by (rewrite <- norm_square, U; ring).
  assert (W : forall v, dot w v = norm w * dot n v) by (intros v; rewrite X at 1; unfold dot, scale; simpl; ring).
  destruct L as [[HD L] | R].
  - left; exists n, (norm w - rho); repeat split; [exact U | lra | |].
    + intros b Hb; rewrite N; pose proof (dot_le n (sub b y)) as C; rewrite U in C.
      replace (dot n (sub w (sub b y))) with (dot w n - dot n (sub b y)) by (unfold dot, sub; simpl; ring).
      rewrite W, NN; lra.
    + replace (norm w - rho - d + e) with (norm w - d - rho + e) by ring; exact L.
  - right; intros b Hb; rewrite N; pose proof (dot_le (sub b y) u) as C; pose proof (norm_nonneg u).
    replace (dot (sub w (sub b y)) u) with (dot w u - dot (sub b y) u) by (unfold dot, sub; simpl; ring); rewrite W.
    assert (norm (sub b y) * norm u <= rho * norm u) by (apply Rmult_le_compat_r; lra); lra.
Qed.

Section Old.

Variables d E H1 H2 V1 V2 : R.
Hypotheses (H1_positive : 0 < H1) (H2_positive : 0 < H2) (something_left : E < d).
Hypotheses (V1_limit : 0 <= V1) (V2_limit : 0 <= V2).
Variables (z1 z2 : R -> vec) (T1 T2 heard1 heard2 : nat -> R) (u1 u2 : nat -> vec) (e1 e2 : nat -> R).
Hypotheses (first1 : T1 0%nat = 0) (first2 : T2 0%nat = 0).
Hypothesis next1 : forall k, T1 k < T1 (S k) <= T1 k + H1.
Hypothesis next2 : forall k, T2 k < T2 (S k) <= T2 k + H2.
Hypothesis go_on1 : forall t, exists k, t < T1 k.
Hypothesis go_on2 : forall t, exists k, t < T2 k.
Hypothesis held1 : forall k t, T1 k <= t <= T1 (S k) -> z1 t = add (z1 (T1 k)) (scale (t - T1 k) (u1 k)).
Hypothesis held2 : forall k t, T2 k <= t <= T2 (S k) -> z2 t = add (z2 (T2 k)) (scale (t - T2 k) (u2 k)).
Hypothesis slow1 : forall s t, 0 <= s <= t -> norm (sub (z1 t) (z1 s)) <= V1 * (t - s).
Hypothesis slow2 : forall s t, 0 <= s <= t -> norm (sub (z2 t) (z2 s)) <= V2 * (t - s).
(** Of which instant the position of the other one is that a robot acts on: any one that is not in the future. *)
Hypothesis past1 : forall k, 0 <= heard1 k <= T1 k.
Hypothesis past2 : forall k, 0 <= heard2 k <= T2 k.
Hypotheses (missed1 : forall k, 0 <= e1 k) (missed2 : forall k, 0 <= e2 k).
Hypothesis in_all : forall k l, total e1 k + total e2 l <= E.
Hypothesis law1 : forall k,
  keeps_off d (d - E) H1 (V2 * (T1 k - heard1 k + H2)) (e1 k) (sub (z1 (T1 k)) (z2 (heard1 k))) (u1 k).
Hypothesis law2 : forall k,
  keeps_off d (d - E) H2 (V1 * (T2 k - heard2 k + H1)) (e2 k) (sub (z2 (T2 k)) (z1 (heard2 k))) (u2 k).
Hypothesis start : d <= norm (sub (z1 0) (z2 0)).

(** ** Robots that act on old positions keep [d], whatever delays and losses made them old *)
(** THEOREM: Two robots that act on positions that the other one had once keep d, whatever delays and losses made them
    old.
    - Between its decisions, at most H apart, a robot moves straight at its command.
    - rho is V times the age of the position and the longest period of the other one, V its limit.
    - Each decision meets n.u >= -(D - d - rho)/H where D >= d + rho, or D n.u >= rho |u|, or stands.
    - Positions are exact, and none is from the future.
    - The robots start at d or farther.
    Silent on: How a pair gets out of d. Positions with errors, plants that drift, bodies that are no discs. *)
Theorem old_positions t : 0 <= t -> d - E <= norm (sub (z1 t) (z2 t)).
Proof.
  apply (asynchronous d E H1 H2) with (T1 := T1) (T2 := T2) (u1 := u1) (u2 := u2) (e1 := e1) (e2 := e2)
    (danger1 := fun k b => norm (sub b (z2 (heard1 k))) <= V2 * (T1 k - heard1 k + H2))
    (danger2 := fun k b => norm (sub b (z1 (heard2 k))) <= V1 * (T2 k - heard2 k + H1)); auto.
  - intros k l s O Hs; pose proof (past1 k); pose proof (next2 l).
    apply Rle_trans with (1 := slow2 (heard1 k) s ltac:(lra)); apply Rmult_le_compat_l; lra.
  - intros k l s O Hs; pose proof (past2 l); pose proof (next1 k).
    apply Rle_trans with (1 := slow1 (heard2 l) s ltac:(lra)); apply Rmult_le_compat_l; lra.
  - pose proof (past1 0%nat) as P; rewrite first1 in P |- *; replace (heard1 0%nat) with 0 by lra.
    replace (sub (z2 0) (z2 0)) with (V 0 0 0) by (unfold sub; f_equal; ring); rewrite norm_0.
    apply Rmult_le_pos; lra.
  - intros k; apply towards_old; auto; lra.
  - intros k; apply towards_old; auto; lra.
Qed.

End Old.
