(** Passive safety: beside a convex set that moves as it likes, without turning, at [Vo] at most.

    At every sample the robot moves away from the set, at the distance [D], at least at the speed
        [min r ((L - D) / h)],
    where [r] is the speed of its retreat and [L] the limit of the law: [d + Vo h], and more against velocity errors.
    With [r = 0] standing still is always allowed ([stands]). The theorems: [own_doing] (had the set stood still since
    the sample), [kept] (a period that starts at the limit), [since] (what is lost since any sample), [restored] (the
    same with a retreat), [loss_is_real] (without one, errors add up).
    A set that corners a robot comes as near as it likes: no law prevents that. Where the robot moves away at
    [bound + Vo] at every sample, [safe_always] applies: the set wanders at [Vo]. *)
Require Import Reals Lra Psatz Lia Safety.
Local Open Scope R_scope.

Section Passive.

Variables (h L : R) (gap : vec -> R).
Hypotheses (h_positive : 0 < h) (convex : forall x, exists n, away gap x n).

(** The law at the relative position [x]. *)
Definition obeys r x u := exists n, away gap x n /\ Rmin r ((L - gap x) / h) <= dot n u.

Lemma stands x : obeys 0 x (V 0 0 0).
Proof.
  destruct (convex x) as [n A]; exists n; split; [exact A |]; pose proof (Rmin_l 0 ((L - gap x) / h)); vectors; lra.
Qed.

(** After the part [s] of a period; [q] is by how much the relative motion is off the command [u]. *)
Lemma after r x u s q : 0 <= s <= h -> obeys r x u -> let y := add x (add (scale s u) q) in
  gap x + s * r - norm q <= gap y \/ gap x + s / h * (L - gap x) - norm q <= gap y.
Proof.
  intros Hs [n [[N G] M]] y; specialize (G y); pose proof (dot_le n q) as C; rewrite N in C.
  replace (dot n (sub y x)) with (s * dot n u + dot n q) in G by (unfold y; vectors; ring).
  apply (Rmult_le_compat_l s) in M; [| lra].
  revert M; unfold Rmin; destruct Rle_dec; intros M; [left; lra | right].
  replace (s / h * (L - gap x)) with (s * ((L - gap x) / h)) by (field; lra); lra.
Qed.

(** Then the distance is not below what it was, or the limit, but for [norm q]. *)
Lemma not_below r x u s q : 0 <= s <= h -> 0 <= r -> obeys r x u ->
  Rmin (gap x) L - norm q <= gap (add x (add (scale s u) q)).
Proof.
  intros Hs Hr O; pose proof (Rmin_l (gap x) L); destruct (after r x u s q Hs O); [nra |].
  assert (P : 0 <= s / h) by (apply Rle_mult_inv_pos; lra).
  assert (Q : s / h <= 1) by (apply Rmult_le_reg_r with h; [lra |]; field_simplify; lra).
  unfold Rmin; destruct (Rle_dec (gap x) L); nra.
Qed.

Lemma steady x y : gap x - norm (sub x y) <= gap y.
Proof.
  destruct (convex x) as [n [N G]]; specialize (G y); pose proof (dot_le n (sub x y)) as C; rewrite N in C.
  replace (dot n (sub y x)) with (- dot n (sub x y)) in G by (vectors; ring); lra.
Qed.

(** * A robot at [z] with commands [u] and retreats [r]; [o] is the reference point of the set. *)
Variables (z o : R -> vec) (u : nat -> vec) (r : nat -> R).
Notation sample := (sample h).
Definition relative k := sub (z (sample k)) (o (sample k)).
Definition lawful k := 0 <= r k /\ obeys (r k) (relative k) (u k).

(** ** Its own doing: had the set stood still since the sample, the robot would not have come below the limit. [w]
    bounds its velocity error. *)
Theorem own_doing k s w : lawful k -> 0 <= s <= h ->
  norm (sub (sub (z (sample k + s)) (z (sample k))) (scale s (u k))) <= w * s ->
  Rmin (gap (relative k)) L - w * s <= gap (sub (z (sample k + s)) (o (sample k))).
Proof.
  intros [Hr O] Hs W; set (q := sub (sub (z (sample k + s)) (z (sample k))) (scale s (u k))) in *.
  pose proof (not_below (r k) _ (u k) s q Hs Hr O) as P.
  replace (sub (z (sample k + s)) (o (sample k))) with (add (relative k) (add (scale s (u k)) q)); [lra |].
  unfold q, relative; destruct (z (sample k + s)); vectors; f_equal; ring.
Qed.

(** ** A period that starts at the limit keeps [d], whatever the set does within its speed. *)
Theorem kept k s d w Vo : lawful k -> 0 <= s <= h -> 0 <= w -> 0 <= Vo ->
  norm (sub (sub (z (sample k + s)) (z (sample k))) (scale s (u k))) <= w * s ->
  norm (sub (o (sample k + s)) (o (sample k))) <= Vo * s ->
  d + (w + Vo) * h <= L -> L <= gap (relative k) -> d <= gap (sub (z (sample k + s)) (o (sample k + s))).
Proof.
  intros O Hs Hw HV W M HL HD; pose proof (own_doing k s w O Hs W) as P; rewrite Rmin_right in P by exact HD.
  pose proof (steady (sub (z (sample k + s)) (o (sample k))) (sub (z (sample k + s)) (o (sample k + s)))) as S.
  replace (sub (sub (z (sample k + s)) (o (sample k))) _) with (sub (o (sample k + s)) (o (sample k))) in S
    by (vectors; f_equal; ring).
  assert ((w + Vo) * s <= (w + Vo) * h) by (apply Rmult_le_compat_l; lra); lra.
Qed.

(** * Many periods *)

(** By how much the relative motion of a period differs from the command: way of the set and error of the robot. *)
Definition off k := norm (sub (sub (relative (S k)) (relative k)) (scale h (u k))).

Lemma step k : lawful k -> Rmin (gap (relative k) + h * r k - off k) (L - off k) <= gap (relative (S k)).
Proof.
  intros [Hr O]; set (q := sub (sub (relative (S k)) (relative k)) (scale h (u k))).
  pose proof (after (r k) _ (u k) h q ltac:(lra) O) as A; unfold q in A.
  replace (add (relative k) _) with (relative (S k)) in A by (destruct (relative (S k)); vectors; f_equal; ring).
  fold (off k) in A; replace (h / h) with 1 in A by (field; lra); unfold Rmin; destruct Rle_dec, A; lra.
Qed.

(** The sum of [f] over [n] periods from sample [K] on. *)
Fixpoint sum (f : nat -> R) K n := match n with O => 0 | S n => sum f K n + f (K + n)%nat end.

Lemma sum_nonneg f K n : (forall k, 0 <= f k) -> 0 <= sum f K n.
Proof. intros H; induction n; simpl; [lra |]; specialize (H (K + n)%nat); lra. Qed.

(** ** From any sample on, what is lost below the limit is at most the way of the set and the errors of the robot. *)
Theorem since K n m : (forall k, (K <= k < K + n)%nat -> lawful k) -> m <= L -> m <= gap (relative K) ->
  m - sum off K n <= gap (relative (K + n)).
Proof.
  intros O Hm H; assert (N : forall k, 0 <= off k) by (intros k; apply norm_nonneg).
  induction n as [| n IH]; simpl; [rewrite Nat.add_0_r; lra |]; specialize (IH ltac:(intros k Hk; apply O; lia)).
  pose proof (O (K + n)%nat ltac:(lia)) as Ok; pose proof (step _ Ok) as T; rewrite Nat.add_succ_r.
  pose proof (sum_nonneg off K n N); destruct Ok as [Hr _]; assert (0 <= h * r (K + n)%nat) by nra.
  revert T; unfold Rmin; destruct Rle_dec; intros T; lra.
Qed.

(** ** With a retreat nothing is lost in a period in which it is as fast as what comes nearer. *)
Theorem restored K n m W : (forall k, (K <= k < K + n)%nat -> lawful k /\ off k <= W) -> m <= L - W ->
  m <= gap (relative K) -> m - sum (fun k => Rmax 0 (off k - h * r k)) K n <= gap (relative (K + n)).
Proof.
  intros O Hm H; set (lost := fun k => Rmax 0 (off k - h * r k)).
  assert (N : forall k, 0 <= lost k) by (intros k; apply Rmax_l).
  induction n as [| n IH]; simpl; [rewrite Nat.add_0_r; lra |]; specialize (IH ltac:(intros k Hk; apply O; lia)).
  destruct (O (K + n)%nat ltac:(lia)) as [Ok Hoff]; pose proof (step _ Ok) as T; rewrite Nat.add_succ_r.
  pose proof (sum_nonneg lost K n N); pose proof (N (K + n)%nat).
  assert (off (K + n) - h * r (K + n)%nat <= lost (K + n)%nat) by apply Rmax_r.
  revert T; unfold Rmin; destruct Rle_dec; intros T; lra.
Qed.

End Passive.

(** ** Without a retreat errors add up: a robot told to stand that drifts by [w] towards a point loses [w] a second. *)
Theorem loss_is_real h L m w : 0 < h -> 0 <= w -> exists (z o : R -> vec) (u : nat -> vec),
  (forall k, lawful h L norm z o u (fun _ => 0) k) /\ (forall t, o t = o 0) /\
  (forall k s, 0 <= s -> norm (sub (sub (z (sample h k + s)) (z (sample h k))) (scale s (u k))) <= w * s) /\
  forall t, 0 <= t -> w * t <= m -> norm (sub (z t) (o t)) = m - w * t.
Proof.
  intros Hh Hw; exists (fun t => V (m - w * t) 0 0), (fun _ => V 0 0 0), (fun _ => V 0 0 0); repeat split.
  - lra.
  - apply stands, away_exists.
  - intros k s Hs; right; unfold norm; transitivity (sqrt (w * s * (w * s))); [f_equal; vectors; ring |].
    apply sqrt_square; nra.
  - intros t Ht Hm; unfold norm; transitivity (sqrt ((m - w * t) * (m - w * t)));
      [f_equal; vectors; ring | apply sqrt_square; lra].
Qed.
