(** What the layer of avoidance may do to a command, and what that does to an intervention: SAFE-GATE, SAFE-DIST.
    Velocities are vectors; the inequality [i] of a body is [b i <= dot (n i) v]. *)
Require Import Reals Lra Psatz Safety.
Local Open Scope R_scope.

(** THEOREM (20): From a safe state any command that is scaled back far enough meets all inequalities.
    - All bounds are at most 0 (a safe state).
    - The factor c is at most bound/rate for every inequality that the command misses. *)
Theorem scaled_back (k : Type) (n : k -> vec) (b : k -> R) v c :
  (forall i, b i <= 0) -> 0 <= c <= 1 ->
  (forall i, dot (n i) v < b i -> c <= b i / dot (n i) v) -> forall i, b i <= dot (n i) (scale c v).
Proof.
  intros B C M i; specialize (B i); specialize (M i).
  replace (dot (n i) (scale c v)) with (c * dot (n i) v) by (vectors; ring); set (r := dot (n i) v) in *.
  destruct (Rlt_dec r (b i)) as [L | L]; [| nra].
  apply M in L as Q; assert (E : b i / r * r = b i) by (field; lra); nra.
Qed.

(** [q] is the projection of [u] onto a convex set with 0 in it: that is all that the premise says. *)
(** THEOREM: Where standing still is allowed, the nearest allowed velocity is no faster than the one asked for.
    - The velocity is the projection onto a convex set that contains 0. *)
Theorem no_faster u q : dot (sub u q) (sub (V 0 0 0) q) <= 0 -> norm q <= norm u.
Proof.
  intros H; apply sqrt_le_1_alt; pose proof (Rle_0_sqr (norm (sub u q))) as S; unfold Rsqr in S.
  rewrite norm_square in S; vectors; lra.
Qed.

(** * SAFE-DIST *)

(** THEOREM: After k disturbed periods inside the safe distance d - (e/A + (1 - A h)^k (f - e/A)) is left.
    - A is positive.
    - f is what was missing at the start. *)
Theorem deficit_closed_form h A e f k : 0 < A -> deficit h A e f k = e / A + (1 - A * h) ^ k * (f - e / A).
Proof. intros P; induction k as [| k IH]; simpl; [ring |]; rewrite IH; unfold missing; field; lra. Qed.

(** THEOREM: If one direction leads away from every near point, one velocity meets all inequalities at once.
    - Every distance is at least d - e/A.
    - There is a unit vector g with n.g >= m > 0 for every near point. *)
Theorem common_direction (k : Type) (n : k -> vec) (d D : k -> R) h A e m g : 0 < h -> 0 < A -> 0 <= e -> 0 < m ->
  norm g = 1 -> (forall i, norm (n i) = 1) -> (forall i, d i - e / A <= D i) ->
  (forall i, D i < d i + h * (e / m) -> m <= dot (n i) g) ->
  forall i, bound h A (d i) (D i) <= dot (n i) (scale (e / m) g).
Proof.
  intros H P E M G N F C i; specialize (N i); specialize (F i); specialize (C i); pose proof (dot_le (n i) g) as B.
  rewrite N, G in B; replace (dot (n i) (scale (e / m) g)) with (e / m * dot (n i) g) by (vectors; ring).
  assert (Q : 0 <= e / m) by (apply Rle_mult_inv_pos; lra); assert (T : e / m * m = e) by (field; lra).
  assert (FA : A * (d i - D i) <= e) by (apply Rle_trans with (A * (e / A)); [nra | right; field; lra]).
  unfold bound; destruct Rle_dec as [I | O].
  - assert (0 <= h * (e / m)) by nra; destruct (Rle_lt_or_eq_dec 0 (e / m) Q) as [L | L].
    + assert (m <= dot (n i) g) by (apply C; nra); nra.
    + rewrite <- L in *; lra.
  - apply Rmult_le_reg_r with h; [lra |]; replace (- (D i - d i) / h * h) with (- (D i - d i)) by (field; lra).
    set (q := e / m) in *; assert (Qh : 0 <= q * h) by nra.
    replace (q * dot (n i) g * h) with (q * h * dot (n i) g) by ring.
    destruct (Rlt_dec (D i) (d i + h * q)) as [L | L]; [apply C in L; nra | nra].
Qed.

(** [r] is the radial speed, [W / 2] the disturbance of the UAV. *)
(** THEOREM: Straight over a UGV, which cannot move along n, the UAV's half of the inequality keeps d - W/A alone.
    - A is positive, and A h is at most 1.
    - The UAV is disturbed by at most W/2. *)
Theorem overhead h A d D r W s : 0 <= s <= h -> 0 < A -> A * h <= 1 -> 0 <= W -> d - W / A <= D <= d ->
  A * (d - D) / 2 <= r -> d - W / A <= D + s * (r - W / 2).
Proof.
  intros Hs P S HW [HD _] L; set (f := W / A) in *; assert (E : W = A * f) by (unfold f; field; lra).
  assert (T : A * s <= 1) by nra; assert (0 <= (D - d + f) * (1 - A * s / 2)) by (apply Rmult_le_pos; lra).
  assert (s * (A * (d - D) / 2 - W / 2) <= s * (r - W / 2)) by (apply Rmult_le_compat_l; lra).
  rewrite E in *; lra.
Qed.
