(** Set-based avoidance keeps the safe distance: any bodies, any number of samples, all real times.

    A distance is a convex function of the difference of two bodies' positions: for two points or balls the norm of it,
    for a ball and a convex set, which may move without turning, the signed distance to that set (Convex.v).

    The law, (7)-(8) and (11) as inequalities: at every sample each body of a pair at distance [D] with safe distance
    [d] moves away from the other at least at its share of
        [A (d - D)]     inside the safe distance,
        [- (D - d) / h] outside of it, which cannot use up the distance left within a period [h].
    The theorems: [lemma] (motion on a straight line), [safe_always], [recovers] (a deficit shrinks by [1 - A h] per
    period). What errors of motion and measurement cost is in Budget.v.
    SAFE-HYP and SAFE-INV check the hypotheses, the ones about a scenario and the ones about a run. *)
Require Import Reals Lra Psatz.
Local Open Scope R_scope.

(** * Vectors of R^3; the plane is [vz = 0] *)
Record vec := V { vx : R; vy : R; vz : R }.
Definition add a b := V (vx a + vx b) (vy a + vy b) (vz a + vz b).
Definition sub a b := V (vx a - vx b) (vy a - vy b) (vz a - vz b).
Definition scale s a := V (s * vx a) (s * vy a) (s * vz a).
Definition mask m a := V (vx m * vx a) (vy m * vy a) (vz m * vz a).
Definition dot a b := vx a * vx b + vy a * vy b + vz a * vz b.
Definition norm a := sqrt (dot a a).
(** [n] is a unit vector along [x] (any, where [x] is 0). *)
Definition along n x := norm n = 1 /\ x = scale (norm x) n.

(** Turns a statement about vectors into one about their coordinates. *)
Ltac vectors := unfold add, sub, scale, mask, dot in *; simpl in *.

Lemma norm_nonneg a : 0 <= norm a.
Proof. apply sqrt_pos. Qed.

Lemma norm_square a : norm a * norm a = dot a a.
Proof. apply sqrt_sqrt; vectors; nra. Qed.

Lemma cauchy_schwarz a b : Rabs (dot a b) <= norm a * norm b.
Proof.
  unfold norm; rewrite <- sqrt_mult_alt by (vectors; nra).
  rewrite <- sqrt_Rsqr_abs; apply sqrt_le_1_alt.
  pose proof (Rle_0_sqr (vx a * vy b - vy a * vx b)); pose proof (Rle_0_sqr (vx a * vz b - vz a * vx b)).
  pose proof (Rle_0_sqr (vy a * vz b - vz a * vy b)); unfold Rsqr in *; vectors; lra.
Qed.

Lemma dot_le a b : - (norm a * norm b) <= dot a b <= norm a * norm b.
Proof. pose proof (cauchy_schwarz a b) as C; revert C; unfold Rabs; destruct Rcase_abs; lra. Qed.

Lemma along_unit x : 0 < norm x -> along (scale (/ norm x) x) x.
Proof.
  intros pos; split.
  - apply Rsqr_inj; unfold Rsqr; [apply norm_nonneg | lra |]; rewrite norm_square.
    transitivity (/ norm x * / norm x * (norm x * norm x)); [rewrite norm_square; vectors; ring | field; lra].
  - destruct x; vectors; f_equal; field; lra.
Qed.

Lemma vec_eq a b : vx a = vx b -> vy a = vy b -> vz a = vz b -> a = b.
Proof. destruct a, b; simpl; intros -> -> ->; reflexivity. Qed.

Lemma norm_0 : norm (V 0 0 0) = 0.
Proof. unfold norm, dot; simpl; replace (0 * 0 + 0 * 0 + 0 * 0) with 0 by ring; apply sqrt_0. Qed.

Lemma norm_scale s a : 0 <= s -> norm (scale s a) = s * norm a.
Proof.
  intros S; unfold norm; replace (dot (scale s a) (scale s a)) with (s * s * dot a a) by (vectors; ring).
  rewrite sqrt_mult_alt by nra; rewrite sqrt_square by exact S; reflexivity.
Qed.

Lemma norm_opposite a : norm (scale (-1) a) = norm a.
Proof. unfold norm; f_equal; vectors; ring. Qed.

Lemma norm_sym a b : norm (sub a b) = norm (sub b a).
Proof. unfold norm; f_equal; vectors; ring. Qed.

Lemma triangle a b : norm (add a b) <= norm a + norm b.
Proof.
  pose proof (norm_nonneg a); pose proof (norm_nonneg b); apply Rsqr_incr_0_var; [| lra]; unfold Rsqr.
  pose proof (dot_le a b); pose proof (norm_square a); pose proof (norm_square b); rewrite norm_square.
  replace (dot (add a b) (add a b)) with (dot a a + 2 * dot a b + dot b b) by (vectors; ring); nra.
Qed.

Lemma norm_difference a b : norm (sub a b) <= norm a + norm b.
Proof.
  rewrite <- (norm_opposite b); replace (sub a b) with (add a (scale (-1) b)) by (apply vec_eq; vectors; ring).
  apply triangle.
Qed.

(** [x] is as long as [y], but for the distance of the two. *)
Lemma nearly x y : norm y - norm (sub x y) <= norm x.
Proof.
  pose proof (norm_difference x (sub x y)) as T.
  replace (sub x (sub x y)) with y in T by (apply vec_eq; vectors; ring); lra.
Qed.

Lemma unit_dot n x : norm n = 1 -> dot n x <= norm x.
Proof. intros N; pose proof (dot_le n x) as C; rewrite N in C; lra. Qed.

Lemma norm_zero a b : norm (sub a b) <= 0 -> a = b.
Proof.
  intros H; pose proof (norm_nonneg (sub a b)); pose proof (norm_square (sub a b)) as Q.
  replace (norm (sub a b)) with 0 in Q by lra; destruct a as [a1 a2 a3], b as [b1 b2 b3]; unfold dot, sub in Q.
  simpl in Q; assert (Z : forall x y z, 0 * 0 = x * x + y * y + z * z -> x = 0) by (intros; nra).
  pose proof (Z (a1 - b1) _ _ Q); pose proof (Z (a2 - b2) (a1 - b1) (a3 - b3) ltac:(lra)).
  pose proof (Z (a3 - b3) (a1 - b1) (a2 - b2) ltac:(lra)); f_equal; lra.
Qed.

(** What is at most [b] along every unit vector is no longer than [b]. *)
Lemma norm_below x b : (forall n, norm n = 1 -> dot n x <= b) -> 0 <= b -> norm x <= b.
Proof.
  intros H Hb; destruct (Req_dec (norm x) 0) as [Z | Z]; [lra |].
  assert (P : 0 < norm x) by (pose proof (norm_nonneg x); lra); destruct (along_unit x P) as [U _].
  specialize (H _ U); replace (dot (scale (/ norm x) x) x) with (/ norm x * (norm x * norm x)) in H.
  - replace (/ norm x * (norm x * norm x)) with (norm x) in H by (field; lra); exact H.
  - rewrite norm_square; vectors; ring.
Qed.

(** From [x] to [y] the distance to 0 grows at least by what [y - x] has along the unit vector. *)
Lemma grows n x y : along n x -> norm x + dot n (sub y x) <= norm y.
Proof.
  intros [unit x_n]; pose proof (dot_le n y) as cs; pose proof (norm_square n) as nn; rewrite unit in *.
  replace (dot n (sub y x)) with (dot n y - norm x * dot n n) by (rewrite x_n at 2; vectors; ring).
  rewrite <- nn; lra.
Qed.

(** [n] leads away: a unit vector along which the convex function [gap] grows at the rate 1, a subgradient of it. *)
Definition away (gap : vec -> R) x n := norm n = 1 /\ forall y, gap x + dot n (sub y x) <= gap y.

(** THEOREM: After a time s on a straight line a distance is at least what it was plus s times its rate of change.
    - The distance is a convex function of the relative position, and n a unit subgradient of it. *)
Theorem lemma gap x n v s : away gap x n -> gap x + s * dot n v <= gap (add x (scale s v)).
Proof.
  intros [_ G]; specialize (G (add x (scale s v))).
  replace (dot n (sub (add x (scale s v)) x)) with (s * dot n v) in G by (vectors; ring); exact G.
Qed.

(** Two points. *)
Lemma away_from_point n x : along n x -> away norm x n.
Proof. intros Ha; split; [apply Ha | intros y; apply grows, Ha]. Qed.

Lemma away_exists x : exists n, away norm x n.
Proof.
  destruct (Rle_lt_or_eq_dec 0 (norm x) (norm_nonneg x)) as [pos | zero].
  - eexists; apply away_from_point, along_unit, pos.
  - exists (V 1 0 0); apply away_from_point; split.
    + unfold norm; vectors; transitivity (sqrt 1); [f_equal; ring | apply sqrt_1].
    + pose proof (norm_square x) as Q; rewrite <- zero in *; destruct x as [a b c]; vectors.
      assert (a = 0 /\ b = 0 /\ c = 0) as [-> [-> ->]] by nra; f_equal; ring.
Qed.

(** THEOREM: The lemma for the distance of two points in the plane.
    - The two bodies are not at the same point. *)
Corollary lemma_in_the_plane x1 x2 v1 v2 s : let D := sqrt (x1 * x1 + x2 * x2) in
  0 < D -> D + s * ((x1 * v1 + x2 * v2) / D) <= sqrt ((x1 + s * v1) * (x1 + s * v1) + (x2 + s * v2) * (x2 + s * v2)).
Proof.
  intros D; set (x := V x1 x2 0); replace D with (norm x) by (unfold norm, D; f_equal; vectors; ring); intros pos.
  pose proof (lemma norm x _ (V v1 v2 0) s (away_from_point _ x (along_unit x pos))) as L.
  replace (sqrt _) with (norm (add x (scale s (V v1 v2 0)))) by (unfold norm; f_equal; unfold x; vectors; ring).
  replace ((x1 * v1 + x2 * v2) / norm x) with (dot (scale (/ norm x) x) (V v1 v2 0)); [exact L |].
  unfold Rdiv; generalize (/ norm x); intros r; unfold x; vectors; ring.
Qed.

(** * One period *)
Section Law.

(** The control period, s, and the gain, 1/s. That [A h <= 1] is no restriction: see [capped] at the end. *)
Variables h A : R.
Hypotheses (h_positive : 0 < h) (A_nonneg : 0 <= A) (no_overshoot : A * h <= 1).

(** The law: the least radial speed of a pair at distance [D] with safe distance [d]. *)
Definition bound d D := if Rle_dec D d then A * (d - D) else - (D - d) / h.

(** Where [f] is missing of the safe distance now, and the radial speed falls short of the law by [e] at most, this is
    what can be missing after the time [s]. *)
Definition missing e f s := (1 - A * s) * f + e * s.

Lemma missing_nonneg e f s : 0 <= s <= h -> 0 <= e -> 0 <= f -> 0 <= missing e f s.
Proof. intros Hs He Hf; unfold missing; assert (A * s <= 1) by nra; nra. Qed.

(** After [s], within the period, no more than that is missing. *)
Lemma period d D e f s :
  0 <= s <= h -> 0 <= f -> d - f <= D -> d - missing e f s <= D + s * (bound d D - e).
Proof.
  intros Hs Hf HD; unfold missing, bound; assert (A * s <= 1) by nra.
  destruct (Rle_dec D d) as [inside | outside].
  - nra.
  - assert (0 <= (D - d) * (1 - s / h)).
    { apply Rmult_le_pos; [lra |]; apply Rmult_le_reg_r with h; [lra |]; field_simplify; lra. }
    replace (s * (- (D - d) / h - e)) with (- (D - d) + (D - d) * (1 - s / h) - e * s) by (field; lra).
    nra.
Qed.

(** * Any bodies, all times *)

(** Bodies are robots and obstacles. Body [i] is at [p i t] at time [t]; its velocity from sample [k] on is [v i k]. *)
Variables (body : Type) (p : body -> R -> vec) (v : body -> nat -> vec).
(** 1 for each axis along which the body can move, else 0: (1, 1, 0) for a UGV. *)
Variable can_move : body -> vec.
(** By how much its motion may differ from [v], m/s: 0 where velocities are held, the top speed of an obstacle that
    moves as it likes. *)
Variable wander : body -> R.
(** The distance of two bodies, by the difference of their positions. *)
Variable gap : body -> body -> vec -> R.
(** Which pairs are to be kept apart, by which distance; the part of the law that the first one of a pair takes; and by
    how much it may miss that part, m/s. *)
Variables (apart : body -> body -> Prop) (d share slack : body -> body -> R).
(** The samples of the run, from the first one on: all, or those below some [N]. *)
Variable sampled : nat -> Prop.
Hypothesis from_the_first : forall k, sampled (S k) -> sampled k.

Definition sample k := INR k * h.
Definition difference i j t := sub (p i t) (p j t).
Definition distance i j t := gap i j (difference i j t).
Definition moved i k s := sub (p i (sample k + s)) (p i (sample k)).
(** Body [i] meets its inequality against [j] at sample [k], up to [slack]; [n] points from [j] to [i]. *)
Definition meets i j k n :=
  share i j * bound (d i j) (distance i j (sample k)) - slack i j <= dot (mask (can_move i) n) (v i k).
(** Even at their speeds the two cannot come within the safe distance before the next sample. *)
Definition far i j k := d i j + (norm (v i k) + wander i + norm (v j k) + wander j) * h <= distance i j (sample k).
(** By how much the radial speed of the pair can fall short of the law. *)
Definition missed i j := slack i j + slack j i + wander i + wander j.

(** Velocities are held from sample to sample, up to [wander]. *)
Hypothesis held : forall i k s, sampled k -> 0 <= s <= h -> norm (sub (moved i k s) (scale s (v i k))) <= wander i * s.
(** No body moves along an axis along which it cannot. *)
Hypothesis moves_as_it_can : forall i k, mask (can_move i) (v i k) = v i k.
Hypothesis symmetric : forall i j, apart i j -> d j i = d i j /\ forall x, gap j i (scale (-1) x) = gap i j x.
(** Distances are convex, and change no faster than positions. *)
Hypothesis convex : forall i j x, apart i j -> exists n, away (gap i j) x n.
(** The two shares of a pair add up to 1. *)
Hypothesis shared : forall i j, apart i j -> share i j + share j i = 1.
(** At every sample both bodies of a pair meet their inequalities, or they are too far apart to matter. *)
Hypothesis law : forall i j k, sampled k -> apart i j ->
  (exists n, away (gap i j) (difference i j (sample k)) n /\ meets i j k n /\ meets j i k (scale (-1) n))
  \/ far i j k.

Lemma dot_mask m n u : mask m u = u -> dot (mask m n) u = dot n u.
Proof. intros E; rewrite <- E at 2; vectors; ring. Qed.

Lemma distance_sym i j t : apart i j -> distance j i t = distance i j t.
Proof.
  intros Hij; unfold distance; rewrite <- (proj2 (symmetric i j Hij)); f_equal; unfold difference; vectors.
  f_equal; ring.
Qed.

(** How far a body moves along [a] is what [v] says, up to [wander]. *)
Lemma moved_along a i k s : sampled k -> 0 <= s <= h ->
  - (norm a * (wander i * s)) <= dot a (moved i k s) - s * dot a (v i k) <= norm a * (wander i * s).
Proof.
  intros Hk Hs; pose proof (held i k s Hk Hs); pose proof (norm_nonneg a).
  pose proof (dot_le a (sub (moved i k s) (scale s (v i k)))).
  replace (dot a (moved i k s) - s * dot a (v i k)) with (dot a (sub (moved i k s) (scale s (v i k))))
    by (vectors; ring); nra.
Qed.

(** One period of a pair. *)
Lemma between i j k s e f : sampled k -> apart i j -> 0 <= s <= h -> missed i j <= e -> 0 <= e -> 0 <= f ->
  d i j - f <= distance i j (sample k) -> d i j - missing e f s <= distance i j (sample k + s).
Proof.
  intros Hk Hij Hs He He0 Hf HD; unfold missed in He; set (D := distance i j (sample k)) in *.
  set (x := difference i j (sample k)) in *; set (y := difference i j (sample k + s)).
  change (d i j - missing e f s <= gap i j y).
  assert (G : forall n, away (gap i j) x n ->
    D + s * (dot n (v i k) - dot n (v j k) - wander i - wander j) <= gap i j y).
  { intros n [N G]; specialize (G y); change (gap i j x) with D in G.
    pose proof (moved_along n i k s Hk Hs) as Vi; pose proof (moved_along n j k s Hk Hs) as Vj; rewrite N in *.
    replace (dot n (sub y x)) with (dot n (moved i k s) - dot n (moved j k s)) in G
      by (unfold x, y, difference, moved; vectors; ring); lra. }
  destruct (law i j k Hk Hij) as [[n [An [Mi Mj]]] | F].
  - specialize (G n An); pose proof (period (d i j) D e f s Hs Hf HD) as P.
    unfold meets in Mi, Mj; rewrite distance_sym, (proj1 (symmetric i j Hij)) in Mj by exact Hij; fold D in Mi, Mj.
    rewrite dot_mask in Mi, Mj by apply moves_as_it_can.
    replace (dot (scale (-1) n) (v j k)) with (- dot n (v j k)) in Mj by (vectors; ring).
    set (B := bound (d i j) D) in *.
    assert (E : B = share i j * B + share j i * B) by (rewrite <- Rmult_plus_distr_r, shared by exact Hij; ring).
    assert (s * (B - e) <= s * (dot n (v i k) - dot n (v j k) - wander i - wander j))
      by (apply Rmult_le_compat_l; lra).
    lra.
  - destruct (convex i j x Hij) as [n An]; specialize (G n An); destruct An as [N _].
    pose proof (dot_le n (v i k)); pose proof (dot_le n (v j k)); rewrite N in *.
    unfold far in F; fold D in F; assert (0 <= missing e f s) by (apply missing_nonneg; lra).
    assert (W : forall b, 0 <= wander b).
    { intros b; pose proof (held b k h Hk ltac:(lra)); pose proof (norm_nonneg (sub (moved b k h) (scale h (v b k)))).
      nra. }
    pose proof (W i); pose proof (W j); pose proof (norm_nonneg (v i k)); pose proof (norm_nonneg (v j k)).
    set (c := norm (v i k) + wander i + norm (v j k) + wander j) in *; assert (0 <= c) by (unfold c; lra).
    assert (- (s * c) <= s * (dot n (v i k) - dot n (v j k) - wander i - wander j))
      by (replace (- (s * c)) with (s * - c) by ring; apply Rmult_le_compat_l; unfold c; lra).
    assert (s * c <= c * h) by nra; lra.
Qed.

(** What may be missing at sample [k], where [f] was missing at the start. *)
Fixpoint deficit e f k := match k with O => f | S k => missing e (deficit e f k) h end.

Lemma deficit_nonneg e f k : 0 <= e -> 0 <= f -> 0 <= deficit e f k.
Proof. intros He Hf; induction k; simpl; [exact Hf | apply missing_nonneg; lra]. Qed.

Lemma next k : sample (S k) = sample k + h.
Proof. unfold sample; rewrite S_INR; ring. Qed.

Theorem at_samples i j e f : apart i j -> missed i j <= e -> 0 <= e -> 0 <= f -> d i j - f <= distance i j 0 ->
  forall k, sampled k -> d i j - deficit e f k <= distance i j (sample k).
Proof.
  intros Hij He He0 Hf H0 k; induction k as [| k IH]; intros Hk.
  - unfold sample; simpl; rewrite Rmult_0_l; exact H0.
  - apply from_the_first in Hk; rewrite next; apply between; auto; [lra | apply deficit_nonneg; lra].
Qed.

(** THEOREM (7)-(8), (11): What a pair lacks of its safe distance shrinks by the factor 1 - A h in each period and never
    grows.
    - The product of gain and control period, A h, is at most 1: min(A h, 1) stands for it (Safety.capped).
    - The shares that the two robots of a pair take add up to 1.
    - Between two samples every body moves on a straight line at its velocity, up to `wander`.
    - A body that cannot leave the plane has no velocity out of it.
    - At every sample each pair meets its two inequalities, or is too far apart to matter.
    - Distances are signed distances to convex sets that do not turn, such as points, balls and polygons (Convex). *)
Theorem recovers i j f : apart i j -> missed i j <= 0 -> 0 <= f -> d i j - f <= distance i j 0 ->
  forall k s, sampled k -> 0 <= s <= h -> d i j - (1 - A * h) ^ k * f <= distance i j (sample k + s).
Proof.
  intros Hij He Hf H0 k s Hk Hs; pose proof (at_samples i j 0 f Hij He (Rle_refl 0) Hf H0 k Hk) as K.
  pose proof (deficit_nonneg 0 f k (Rle_refl 0) Hf) as N.
  pose proof (between i j k s 0 (deficit 0 f k) Hk Hij Hs He (Rle_refl 0) N K) as B.
  assert (E : deficit 0 f k = (1 - A * h) ^ k * f).
  { clear; induction k as [| k IH]; simpl; [ring | rewrite IH; unfold missing; ring]. }
  rewrite <- E; unfold missing in B; assert (0 <= A * s) by nra; nra.
Qed.

(** ** Safety at all times of the samples that there are *)
Theorem safe i j : apart i j -> missed i j <= 0 -> d i j <= distance i j 0 ->
  forall k s, sampled k -> 0 <= s <= h -> d i j <= distance i j (sample k + s).
Proof.
  intros Hij He H0 k s Hk Hs.
  pose proof (recovers i j 0 Hij He (Rle_refl 0) ltac:(lra) k s Hk Hs) as P; rewrite Rmult_0_r in P; lra.
Qed.

(** Every time lies in a period. *)
Lemma periods t : 0 <= t -> exists k s, 0 <= s <= h /\ t = sample k + s.
Proof.
  intros Ht; assert (exists k, t < sample k) as [k Hk].
  { exists (Z.to_nat (up (t / h))); destruct (archimed (t / h)) as [U _]; assert (T : t = t / h * h) by (field; lra).
    assert (0 <= t / h) by (apply Rle_mult_inv_pos; lra); unfold sample; rewrite INR_IZR_INZ, Z2Nat.id; [nra |].
    apply le_IZR; lra. }
  induction k as [| k IH]; [unfold sample in Hk; simpl in Hk; lra |]; rewrite next in Hk.
  destruct (Rlt_dec t (sample k)) as [L | L]; [apply IH, L | exists k, (t - sample k); lra].
Qed.

(** THEOREM (7)-(8), (11): Any number of bodies whose pairs start at their safe distances keep them at all times.
    - The hypotheses of Safety.recovers.
    - The pair starts at its safe distance or farther. *)
Corollary safe_always i j : (forall k, sampled k) -> apart i j -> missed i j <= 0 -> d i j <= distance i j 0 ->
  forall t, 0 <= t -> d i j <= distance i j t.
Proof. intros Hk Hij He H0 t Ht; destruct (periods t Ht) as [k [s [Hs ->]]]; apply safe; auto. Qed.

(** * What meets the hypotheses *)

(** An obstacle that moves wanders at its top speed; the robot then takes the slack [- wander j]: [missed] is 0. *)
(** THEOREM (7), (11): A body that is held still and takes no share meets its inequality.
    - The body has velocity 0, share 0 and slack 0. *)
Lemma obstacle i j k n : v j k = V 0 0 0 -> share j i = 0 -> slack j i = 0 -> meets j i k n.
Proof. intros E Q P; unfold meets; rewrite E, Q, P; vectors; lra. Qed.

(** THEOREM: A pair farther apart than the sensing range needs no inequality until the next sample.
    - The sensing range is at least d + c h.
    - c is at least the sum of the two speeds. *)
Lemma unseen i j k r c : norm (v i k) + wander i + norm (v j k) + wander j <= c -> d i j + c * h <= r ->
  r <= distance i j (sample k) -> far i j k.
Proof. intros C Hr Hd; unfold far; nra. Qed.

(** THEOREM: At its safe distance or farther a body that stands still meets its inequality.
    - A h is at most 1.
    - The share is not negative. *)
Lemma standing i j k n : v i k = V 0 0 0 -> 0 <= share i j -> 0 <= slack i j ->
  d i j <= distance i j (sample k) -> meets i j k n.
Proof.
  intros E Q P HD; unfold meets; rewrite E; set (D := distance i j (sample k)) in *.
  assert (bound (d i j) D <= 0).
  { unfold bound; destruct Rle_dec; [nra |]; apply Rmult_le_reg_r with h; [lra |].
    replace (- (D - d i j) / h * h) with (- (D - d i j)) by (field; lra); lra. }
  assert (share i j * bound (d i j) D <= 0) by nra; vectors; lra.
Qed.

End Law.

(** The program multiplies in floating point, where [A h] may come out above 1 by rounding. *)
(** THEOREM: A gain with A h > 1 asks for more than min(A, 1/h), so that the theorems cover it with min(A h, 1).
    - h is positive. *)
Theorem capped h A d D : 0 < h ->
  Rmin A (/ h) * h <= 1 /\ bound h (Rmin A (/ h)) d D <= bound h A d D.
Proof.
  intros H; split.
  - apply Rle_trans with (/ h * h); [apply Rmult_le_compat_r; [lra | apply Rmin_r] | right; field; lra].
  - unfold bound; destruct (Rle_dec D d); [apply Rmult_le_compat_r; [lra | apply Rmin_l] | lra].
Qed.
