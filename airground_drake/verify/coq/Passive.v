(** Passive safety: beside a convex set that moves as it likes, without turning, at [Vo] at most.

    At every sample the robot moves away from the set, at the distance [D], at least at the speed
        [min r ((L - D) / h)],
    where [r] is the speed of its retreat and [L] the limit of the law: [d + Vo h], and more against errors of its own.
    With [r = 0] standing still is always allowed ([stands]). The theorems: [own_doing] (had the set stood still since
    the sample), [kept] (a period that starts at the limit), [since] (what is lost since any sample), [restored] and
    [held_off] (the same with a retreat), [loss_is_real] (without one, errors add up).
    The law steers the point [z], and the body [x] stays within [cover] of it. In a period [z] is off the line of the
    command by [w s + f] after [s]: [f] is its dip, and [w] its drift.
    A set that corners a robot comes as near as it likes: no law prevents that. Where the robot moves away at
    [bound + Vo] at every sample, Budget.v applies: the slack is [- Vo], and the set drifts at [Vo]. *)
Require Import Reals Lra Psatz Lia Safety.
Local Open Scope R_scope.

Section Passive.

Variables (h L e : R) (gap : vec -> R).
Hypotheses (h_positive : 0 < h) (convex : forall x, exists n, away gap x n).

(** The law at the relative position [x]. *)
Definition obeys r x u := 0 <= r /\ exists n, away gap x n /\ Rmin r ((L - gap x) / h) <= dot n u.

(** The same at a distance that was measured, with the error [e], to be at the limit or farther. *)
Definition advances x u := exists w n, norm (sub w x) <= e /\ away gap w n /\
  L <= gap w - e /\ (L - (gap w - e)) / h <= dot n u.

Definition lawful r x u := obeys r x u \/ advances x u.

Lemma stands x : obeys 0 x (V 0 0 0).
Proof.
  destruct (convex x) as [n A]; split; [lra |]; exists n; split; [exact A |].
  pose proof (Rmin_l 0 ((L - gap x) / h)); vectors; lra.
Qed.

(** After the part [s] of a period; [q] is by how much the relative motion is off the command [u]. *)
Lemma after r x u s q : 0 <= s <= h -> lawful r x u -> let y := add x (add (scale s u) q) in
  0 <= r /\ gap x + s * r - norm q <= gap y \/ gap x + s / h * (L - gap x) - norm q <= gap y \/ L - norm q <= gap y.
Proof.
  intros Hs O y; assert (S : forall D, s / h * D = s * (D / h)) by (intros; field; lra).
  destruct O as [[R0 [n [[N G] M]]] | [w [n [E [[N G] [Far M]]]]]]; specialize (G y).
  all: apply (Rmult_le_compat_l s) in M; [| lra].
  - pose proof (dot_le n q) as Q; rewrite N in Q.
    replace (dot n (sub y x)) with (s * dot n u + dot n q) in G by (unfold y; vectors; ring); rewrite S.
    revert M; unfold Rmin; destruct Rle_dec; intros M; [left; lra | right; left; lra].
  - right; right; pose proof (dot_le n q) as Q; pose proof (dot_le n (sub w x)) as P; rewrite N in P, Q.
    replace (dot n (sub y w)) with (s * dot n u + dot n q - dot n (sub w x)) in G by (unfold y; vectors; ring).
    rewrite <- S in M; assert (s / h <= 1) by (apply Rmult_le_reg_r with h; [lra |]; field_simplify; lra).
    assert (0 <= s / h) by (apply Rle_mult_inv_pos; lra); nra.
Qed.

(** Then the distance is not below what it was, or the limit, but for [norm q]. *)
Lemma not_below r x u s q : 0 <= s <= h -> lawful r x u ->
  Rmin (gap x) L - norm q <= gap (add x (add (scale s u) q)).
Proof.
  intros Hs O; pose proof (Rmin_l (gap x) L); pose proof (Rmin_r (gap x) L).
  destruct (after r x u s q Hs O) as [[Hr A] | [A | A]]; [nra | | lra].
  assert (P : 0 <= s / h) by (apply Rle_mult_inv_pos; lra).
  assert (Q : s / h <= 1) by (apply Rmult_le_reg_r with h; [lra |]; field_simplify; lra).
  unfold Rmin in *; destruct (Rle_dec (gap x) L); nra.
Qed.

Lemma steady x y : gap x - norm (sub x y) <= gap y.
Proof.
  destruct (convex x) as [n [N G]]; specialize (G y); pose proof (unit_dot n (sub x y) N) as C.
  replace (dot n (sub y x)) with (- dot n (sub x y)) in G by (vectors; ring); lra.
Qed.

(** * A robot with commands [u] and retreats [r]; [o] is the reference point of the set. *)
Variables (z x o : R -> vec) (u : nat -> vec) (r : nat -> R).
Notation sample := (sample h).
Definition relative k := sub (z (sample k)) (o (sample k)).
Definition obeying k := lawful (r k) (relative k) (u k).

(** THEOREM: Had the set stood still since the sample, the robot would be at min(D, L) or farther, less drift, dip and
    cover.
    - In the period the robot moves away from the set at min(r, (L - D)/h) or faster; r is the speed of its retreat.
    - r is not negative.
    - Distances are signed distances to convex sets that do not turn, such as points, balls and polygons (Convex).
    Silent on: That the robot keeps a distance: what is missing, the set has moved itself. *)
Theorem own_doing k s w f cover : obeying k -> 0 <= s <= h ->
  norm (sub (sub (z (sample k + s)) (z (sample k))) (scale s (u k))) <= w * s + f ->
  norm (sub (x (sample k + s)) (z (sample k + s))) <= cover ->
  Rmin (gap (relative k)) L - (w * s + f) - cover <= gap (sub (x (sample k + s)) (o (sample k))).
Proof.
  intros O Hs W C; set (t := sample k + s) in *; set (q := sub (sub (z t) (z (sample k))) (scale s (u k))) in *.
  pose proof (not_below (r k) _ (u k) s q Hs O) as P; unfold q in P at 2.
  replace (add (relative k) _) with (sub (z t) (o (sample k))) in P
    by (unfold relative; apply vec_eq; vectors; ring).
  pose proof (steady (sub (z t) (o (sample k))) (sub (x t) (o (sample k)))) as S.
  replace (sub (sub (z t) _) _) with (sub (z t) (x t)) in S by (vectors; f_equal; ring).
  rewrite (norm_sym (z t)) in S; lra.
Qed.

(** What else is missing the set has moved itself. *)
Lemma set_moves k s : gap (sub (x (sample k + s)) (o (sample k))) - norm (sub (o (sample k + s)) (o (sample k)))
  <= gap (sub (x (sample k + s)) (o (sample k + s))).
Proof.
  set (t := sample k + s); pose proof (steady (sub (x t) (o (sample k))) (sub (x t) (o t))) as S.
  replace (sub (sub (x t) (o (sample k))) _) with (sub (o t) (o (sample k))) in S by (vectors; f_equal; ring); exact S.
Qed.

(** THEOREM: A period that starts at L or farther keeps d, whatever the set does at Vo or slower.
    - The hypotheses of Passive.own_doing.
    - L is at least d + cover + dip + (w + Vo) h, w the drift of the robot.
    Silent on: Anything about a period that starts nearer than L. *)
Theorem kept k s d w f cover Vo : obeying k -> 0 <= s <= h -> 0 <= w -> 0 <= Vo ->
  norm (sub (sub (z (sample k + s)) (z (sample k))) (scale s (u k))) <= w * s + f ->
  norm (sub (x (sample k + s)) (z (sample k + s))) <= cover ->
  norm (sub (o (sample k + s)) (o (sample k))) <= Vo * s ->
  d + cover + f + (w + Vo) * h <= L -> L <= gap (relative k) -> d <= gap (sub (x (sample k + s)) (o (sample k + s))).
Proof.
  intros O Hs Hw HV W C M HL HD; pose proof (own_doing k s w f cover O Hs W C) as P;
    rewrite Rmin_right in P by exact HD.
  pose proof (set_moves k s); assert ((w + Vo) * s <= (w + Vo) * h) by (apply Rmult_le_compat_l; lra); lra.
Qed.

(** * Many periods *)

(** By how much the relative motion of a period differs from the command: at most the way of the set and the drift of
    the robot. *)
Definition off k := norm (sub (sub (relative (S k)) (relative k)) (scale h (u k))).
Definition way k := norm (sub (o (sample (S k))) (o (sample k))).

Lemma off_is k w : norm (sub (sub (z (sample (S k))) (z (sample k))) (scale h (u k))) <= w -> off k <= w + way k.
Proof.
  intros W; unfold off, way, relative; eapply Rle_trans; [| apply Rplus_le_compat_r, W].
  eapply Rle_trans; [| apply norm_difference]; right; f_equal; apply vec_eq; vectors; ring.
Qed.

Lemma step k : obeying k -> 0 <= r k /\ gap (relative k) + h * r k - off k <= gap (relative (S k)) \/
  L - off k <= gap (relative (S k)).
Proof.
  intros O; set (q := sub (sub (relative (S k)) (relative k)) (scale h (u k))).
  pose proof (after (r k) _ (u k) h q ltac:(lra) O) as A; unfold q in A.
  replace (add (relative k) _) with (relative (S k)) in A by (apply vec_eq; vectors; ring).
  fold (off k) in A; replace (h / h) with 1 in A by (field; lra).
  destruct A as [A | [A | A]]; [left | right | right]; lra.
Qed.

(** The sum of [f] over [n] periods from sample [K] on. *)
Fixpoint sum (f : nat -> R) K n := match n with O => 0 | S n => sum f K n + f (K + n)%nat end.

Lemma sum_nonneg f K n : (forall k, 0 <= f k) -> 0 <= sum f K n.
Proof. intros H; induction n; simpl; [lra |]; specialize (H (K + n)%nat); lra. Qed.

(** ** With a retreat nothing is lost in a period in which it is as fast as what comes nearer, [b k]. *)
(** THEOREM: A retreat that is as fast as what comes nearer in a period loses nothing in it.
    - The hypotheses of Passive.own_doing.
    - The distance starts at L, or nearer by at most what one period can take away. *)
Theorem restored K n m W b : (forall k, (K <= k < K + n)%nat -> obeying k /\ off k <= b k <= W) ->
  m <= L - W -> m <= gap (relative K) ->
  m - sum (fun k => Rmax 0 (b k - h * r k)) K n <= gap (relative (K + n)).
Proof.
  intros O Hm H; set (lost := fun k => Rmax 0 (b k - h * r k)).
  assert (N : forall k, 0 <= lost k) by (intros k; apply Rmax_l).
  induction n as [| n IH]; simpl; [rewrite Nat.add_0_r; lra |]; specialize (IH ltac:(intros k Hk; apply O; lia)).
  destruct (O (K + n)%nat ltac:(lia)) as [Ok Hoff]; rewrite Nat.add_succ_r.
  pose proof (sum_nonneg lost K n N); pose proof (N (K + n)%nat).
  assert (b (K + n)%nat - h * r (K + n)%nat <= lost (K + n)%nat) by apply Rmax_r.
  destruct (step _ Ok) as [T | T]; lra.
Qed.

(** ** A period in which the robot retreats as fast as the set approaches and as it drifts itself, [W]. *)
(** THEOREM: While the robot retreats as fast as the set approaches, the distance falls by the dip at most.
    - The hypotheses of Passive.own_doing.
    - r is at least the speed of the set and the drift of the robot together. *)
Theorem held_off k s m W f : obeying k -> 0 <= s <= h -> W <= r k -> m <= L - W * h -> m <= gap (relative k) ->
  norm (sub (sub (sub (z (sample k + s)) (o (sample k + s))) (relative k)) (scale s (u k))) <= W * s + f -> 0 <= W ->
  m - f <= gap (sub (z (sample k + s)) (o (sample k + s))).
Proof.
  intros O Hs HW Hm H Q W0; set (t := sample k + s) in *; set (q := sub (sub (sub (z t) (o t)) _) _) in Q.
  pose proof (after (r k) _ (u k) s q Hs O) as A; cbv zeta in A.
  replace (add (relative k) _) with (sub (z t) (o t)) in A by (unfold q; apply vec_eq; vectors; ring).
  assert (W * s <= W * h) by (apply Rmult_le_compat_l; lra); destruct A as [[_ A] | [A | A]]; [nra | | lra].
  assert (P : 0 <= s / h) by (apply Rle_mult_inv_pos; lra).
  assert (S : s / h <= 1) by (apply Rmult_le_reg_r with h; [lra |]; field_simplify; lra).
  assert (E : W * s = s / h * (W * h)) by (field; lra); rewrite E in Q; nra.
Qed.

(** ** From any sample on, what is lost below the limit is at most [b k] a period: the way of the set and the drift of
    the robot. *)
(** THEOREM: Since any sample the distance has fallen below L by no more than the set's way and the robot's drift.
    - The hypotheses of Passive.own_doing. *)
Theorem since K n m b : (forall k, (K <= k < K + n)%nat -> obeying k /\ off k <= b k) -> m <= L ->
  m <= gap (relative K) -> m - sum b K n <= gap (relative (K + n)).
Proof.
  intros O Hm H; assert (N : 0 <= sum off K n) by (apply sum_nonneg; intros; apply norm_nonneg).
  enough (P : m - sum off K n <= gap (relative (K + n)) /\ sum off K n <= sum b K n) by lra; clear N.
  induction n as [| n IH]; simpl; [rewrite Nat.add_0_r; lra |].
  destruct (IH ltac:(intros k Hk; apply O; lia)) as [P Q]; destruct (O (K + n)%nat ltac:(lia)) as [Ok Hoff].
  rewrite Nat.add_succ_r; assert (0 <= sum off K n) by (apply sum_nonneg; intros; apply norm_nonneg).
  split; [| lra]; destruct (step _ Ok) as [T | T]; [nra | lra].
Qed.

End Passive.

(** THEOREM: Without a retreat errors add up: a robot told to stand that drifts towards a point loses all of its drift.
    - The drift is not negative. *)
Theorem loss_is_real h L m w : 0 < h -> 0 <= w -> exists (z o : R -> vec) (u : nat -> vec),
  (forall k, obeying h L 0 norm z o u (fun _ => 0) k) /\ (forall t, o t = o 0) /\
  (forall k s, 0 <= s -> norm (sub (sub (z (sample h k + s)) (z (sample h k))) (scale s (u k))) <= w * s) /\
  forall t, 0 <= t -> w * t <= m -> norm (sub (z t) (o t)) = m - w * t.
Proof.
  intros Hh Hw; exists (fun t => V (m - w * t) 0 0), (fun _ => V 0 0 0), (fun _ => V 0 0 0); split; [| repeat split].
  - intros k; left; apply stands, away_exists.
  - intros k s Hs; right; unfold norm; transitivity (sqrt (w * s * (w * s))); [f_equal; vectors; ring |].
    apply sqrt_square; nra.
  - intros t Ht Hm; unfold norm; transitivity (sqrt ((m - w * t) * (m - w * t)));
      [f_equal; vectors; ring | apply sqrt_square; lra].
Qed.
