(** Convex sets, and distances from them as the other theories take them.

    A set that moves without turning is a fixed set, seen from its reference point: [x] is the position of a robot less
    that of the set. Two points are a point and the set {0}. A body of radius [r] keeps [d] if its centre keeps [d + r].
    "At least [d] away" is said in two ways: [clear], all points of the set are so far away; or [d <= gap x] with the
    signed distance [gap], which also says how deep [x] is inside. For [d > 0] they are the same ([clear_gap]). *)
Require Import Reals Lra Psatz List Safety.
Import ListNotations.
Local Open Scope R_scope.

(** [x] is [m] or farther from all of the set. *)
Definition clear (inside : vec -> Prop) m x := forall c, inside c -> m <= norm (sub x c).

(** [y] is the point of the set that is nearest to [x], and [n] points from there to [x]. The set is behind its plane:
    of a polygon the corners decide that ([at_corners]). *)
Definition nearest (inside : vec -> Prop) x y n :=
  inside y /\ along n (sub x y) /\ forall c, inside c -> dot n (sub c y) <= 0.

(** * Points *)
(** Two points keep away from each other: their difference from the set {0}. *)
Definition points c := c = V 0 0 0.

Lemma clear_points m x : clear points m x <-> m <= norm x.
Proof.
  assert (E : sub x (V 0 0 0) = x) by (apply vec_eq; vectors; ring).
  split; [intros H; specialize (H _ eq_refl); rewrite E in H; exact H | intros H c ->; rewrite E; exact H].
Qed.

Lemma nearest_of_points x n : along n x -> nearest points x (V 0 0 0) n.
Proof.
  intros Ha; split; [reflexivity | split].
  - replace (sub x (V 0 0 0)) with x by (apply vec_eq; vectors; ring); exact Ha.
  - intros c ->; vectors; lra.
Qed.

(** * Corners *)

(** The convex hull: a wall is the hull of 2 corners, a polygon or a prism of its corners. *)
Inductive hull (corners : list vec) : vec -> Prop :=
| corner c : In c corners -> hull corners c
| between a b l : hull corners a -> hull corners b -> 0 <= l <= 1 -> hull corners (add a (scale l (sub b a))).

(** A half-space contains a hull if it contains the corners. *)
Theorem at_corners corners n b : (forall c, In c corners -> dot n c <= b) -> forall c, hull corners c -> dot n c <= b.
Proof.
  intros H c Hc; induction Hc as [c Hc | a a' l _ IHa _ IHb Hl]; [exact (H c Hc) |].
  replace (dot n (add a (scale l (sub a' a)))) with ((1 - l) * dot n a + l * dot n a') by (vectors; ring); nra.
Qed.

(** * The signed distance to a convex set *)
Section Signed.

Variables (inside : vec -> Prop) (gap : vec -> R).

(** Inside: minus the depth, the radius of the largest ball about [x] in the set. The set ends there along [n]. *)
Definition deep x n := norm n = 1 /\ gap x <= 0 /\
  (forall c, inside c -> dot n (sub c x) <= - gap x) /\ (forall e, norm e <= - gap x -> inside (add x e)).

(** Outside: the distance from the nearest point. *)
Definition outside x n := exists y, nearest inside x y n /\ gap x = norm (sub x y).

Definition signed_distance := forall x, exists n, deep x n \/ outside x n.

Lemma behind x n : deep x n \/ outside x n -> norm n = 1 /\ forall c, inside c -> gap x + dot n (sub c x) <= 0.
Proof.
  intros [[N [_ [B _]]] | [y [[_ [[N X] B]] G]]]; split; try exact N; intros c Hc; specialize (B c Hc); [lra |].
  pose proof (norm_square n) as Q; rewrite N in Q; rewrite G; set (D := norm (sub x y)) in *.
  replace (dot n (sub c x)) with (dot n (sub c y) - dot n (sub x y)) by (vectors; ring).
  rewrite X; replace (dot n (scale D n)) with (D * dot n n) by (vectors; ring); rewrite <- Q; lra.
Qed.

(** THEOREM: The signed distance to a convex set is convex, and the unit vector away from the set is a subgradient of
    it.
    - The signed distance is that from a nearest point, or inside minus the depth (Convex.signed_distance). *)
Theorem leads_away x n : signed_distance -> deep x n \/ outside x n -> away gap x n.
Proof.
  intros S H; apply behind in H; destruct H as [N B]; split; [exact N |]; intros z.
  pose proof (norm_square n) as Q; rewrite N in Q.
  destruct (S z) as [m [[_ [G [_ I]]] | [y [[I _] G]]]].
  - specialize (B (add z (scale (- gap z) n))); enough (E : norm (scale (- gap z) n) <= - gap z).
    + specialize (B (I _ E)); replace (dot n (sub (add z (scale (- gap z) n)) x))
        with (dot n (sub z x) - gap z * dot n n) in B by (vectors; ring); rewrite <- Q in B; lra.
    + rewrite norm_scale, N by lra; lra.
  - specialize (B y I); pose proof (unit_dot n (sub z y) N) as C; rewrite <- G in C.
    replace (dot n (sub y x)) with (dot n (sub z x) - dot n (sub z y)) in B by (vectors; ring); lra.
Qed.

(** THEOREM: A signed distance of at least m > 0 is a distance of at least m from every point of the set.
    - The signed distance is that from a nearest point, or inside minus the depth (Convex.signed_distance). *)
Theorem clear_gap m x : signed_distance -> 0 < m -> (clear inside m x <-> m <= gap x).
Proof.
  intros S M; destruct (S x) as [n H]; split.
  - intros C; destruct H as [[_ [G [_ I]]] | [y [[I _] ->]]]; [| exact (C y I)].
    assert (Z : norm (V 0 0 0) <= - gap x) by (rewrite norm_0; lra); specialize (C _ (I _ Z)).
    replace (sub x (add x (V 0 0 0))) with (V 0 0 0) in C by (vectors; f_equal; ring); rewrite norm_0 in C; lra.
  - intros G c Hc; apply behind in H; destruct H as [N B]; specialize (B c Hc); apply Rle_trans with (1 := G).
    pose proof (unit_dot n (sub x c) N); replace (dot n (sub c x)) with (- dot n (sub x c)) in B by (vectors; ring);
      lra.
Qed.

End Signed.

(** * Instances *)

(** THEOREM: The distance from a ball or point is convex, and the unit vector away from its centre is a subgradient of
    it.
    - The vector points away from the centre. *)
Theorem ball r x n : along n x -> away (fun x => norm x - r) x n.
Proof. intros Ha; split; [apply Ha | intros y; pose proof (grows n x y Ha); lra]. Qed.

(** THEOREM: Inside a polygon the unit vector away is normal to the nearest edge, whose line is as far as the set is
    deep.
    - The set is an intersection of half-planes or half-spaces.
    - The point is in it. *)
Theorem nearest_edge (edges : list (vec * R)) gap x n b :
  let inside c := forall m a, In (m, a) edges -> dot m c <= a in
  (forall m a, In (m, a) edges -> norm m = 1) -> In (n, b) edges -> gap x = dot n x - b ->
  (forall m a, In (m, a) edges -> dot m x - a <= gap x) -> gap x <= 0 -> deep inside gap x n.
Proof.
  intros inside U E G L Z; repeat split; [apply (U n b E) | exact Z | |].
  - intros c Hc; specialize (Hc n b E); rewrite G.
    replace (dot n (sub c x)) with (dot n c - dot n x) by (vectors; ring); lra.
  - intros e He m a Hm; specialize (L m a Hm); pose proof (unit_dot m e (U m a Hm)) as C.
    replace (dot m (add x e)) with (dot m x + dot m e) by (vectors; ring); lra.
Qed.

(** THEOREM: Outside a convex set the unit vector away from it is the direction from its nearest point.
    - The set is convex.
    - No point of it is nearer, and the point is not in it. *)
Theorem nearest_point (inside : vec -> Prop) x y :
  (forall a b l, inside a -> inside b -> 0 <= l <= 1 -> inside (add a (scale l (sub b a)))) ->
  inside y -> (forall c, inside c -> norm (sub x y) <= norm (sub x c)) -> 0 < norm (sub x y) ->
  nearest inside x y (scale (/ norm (sub x y)) (sub x y)).
Proof.
  intros C Hy M pos; split; [exact Hy | split; [apply along_unit, pos |]]; intros z Hz.
  set (r := norm (sub x y)) in *; replace (dot (scale (/ r) (sub x y)) (sub z y)) with (/ r * dot (sub x y) (sub z y))
    by (vectors; ring).
  assert (I : 0 < / r) by (apply Rinv_0_lt_compat, pos); enough (dot (sub x y) (sub z y) <= 0) by nra.
  set (a := dot (sub x y) (sub z y)); apply Rnot_lt_le; intros Ha; set (w := dot (sub z y) (sub z y)).
  assert (W : 0 <= w) by (unfold w; rewrite <- norm_square; apply Rle_0_sqr).
  (* A step from y towards z of l = a / (a + w) would come nearer. *)
  set (l := a / (a + w)); assert (L : l * (a + w) = a) by (unfold l; field; apply Rgt_not_eq; lra).
  assert (L0 : 0 < l) by (apply Rdiv_lt_0_compat; lra); assert (L1 : l <= 1) by nra.
  specialize (M (add y (scale l (sub z y))) (C y z l Hy Hz ltac:(lra))).
  set (q := norm (sub x (add y (scale l (sub z y))))) in *.
  assert (Le : r * r <= q * q) by (apply Rmult_le_compat; lra).
  assert (q * q = r * r - 2 * l * a + l * l * w).
  { unfold q, r; rewrite !norm_square; unfold a, w; clearbody l; clear; destruct x, y, z; vectors; ring. }
  assert (l * l * w = l * a - l * l * a) by (transitivity (l * (l * (a + w)) - l * l * a); [ring | rewrite L; ring]).
  assert (0 < l * a) by (apply Rmult_lt_0_compat; lra); nra.
Qed.
