(** Between two updates the decision variable is largest at an end, and its least value has a closed form: no crossing
    of a level is missed. THR-TRIG checks the hypotheses. *)
Require Import Reals Lra Psatz Safety.
Local Open Scope R_scope.

(** The error moves from [a] to [b] on a straight line, the noise from [n0] to [n1]; [l] is the share of the step. *)
Definition x a b n0 n1 l := norm (add (scale (1 - l) a) (scale l b)) + ((1 - l) * n0 + l * n1).

(** THEOREM (15), (20): Between two updates the decision variable is nowhere above the larger of its ends.
    - Between two updates error and noise are linear in time. *)
Theorem largest_at_an_end a b n0 n1 l : 0 <= l <= 1 -> x a b n0 n1 l <= Rmax (norm a + n0) (norm b + n1).
Proof.
  intros H; unfold x; pose proof (triangle (scale (1 - l) a) (scale l b)) as T; rewrite !norm_scale in T by lra.
  pose proof (Rmax_l (norm a + n0) (norm b + n1)); pose proof (Rmax_r (norm a + n0) (norm b + n1)); nra.
Qed.

(** ** On the line, at [u] from its point nearest to 0, which is at [p] from 0, with noise [k u]: least is [p w]. *)
(** THEOREM (15), (20): Between two updates the decision variable is nowhere below p w, p the distance of the error's
    line from 0.
    - Between two updates error and noise are linear in time.
    - w^2 + k^2 = 1, k the rate of the noise. *)
Theorem nowhere_below p u k w : w ^ 2 + k ^ 2 = 1 -> p * w <= sqrt (u ^ 2 + p ^ 2) + k * u.
Proof.
  intros W; pose proof (proj2 (dot_le (V w (- k) 0) (V p u 0))) as C.
  assert (N : norm (V w (- k) 0) = 1) by (rewrite <- sqrt_1, <- W; unfold norm, dot; cbn -[pow]; f_equal; ring).
  replace (norm (V p u 0)) with (sqrt (u ^ 2 + p ^ 2)) in C by (unfold norm, dot; cbn -[pow]; f_equal; ring).
  rewrite N in C; unfold dot in C; cbn -[pow] in C; lra.
Qed.

(** THEOREM (15), (20): The decision variable attains p w at one point of the line.
    - The hypotheses of Isolation.nowhere_below.
    - w is positive. *)
Theorem attained p u k w : w ^ 2 + k ^ 2 = 1 -> 0 < w -> 0 <= p -> u = - p * k / w ->
  sqrt (u ^ 2 + p ^ 2) + k * u = p * w.
Proof.
  intros W Pw Pp ->; replace ((- p * k / w) ^ 2 + p ^ 2) with (Rsqr (p / w)).
  - rewrite sqrt_Rsqr by (apply Rle_mult_inv_pos; lra).
    transitivity (p / w * (1 - k ^ 2)); [field; lra | rewrite <- W; field; lra].
  - unfold Rsqr; transitivity (p ^ 2 / w ^ 2 * (w ^ 2 + k ^ 2)); [rewrite W |]; field; lra.
Qed.
