(** The hypotheses of [safe_always] can be met by a robot that moves: half of the excess is left after every period. *)
Require Import Reals Lra Psatz Safety.
Local Open Scope R_scope.

(** The robot is [true]; the obstacle, [false], is at 0. With d = 1, h = 1, A = 1 the robot is at 1 + (1/2)^k at sample
    [k]. *)
Definition excess (k : nat) : R := (1 / 2) ^ k.
Definition v (i : bool) (k : nat) := if i then V (- excess k / 2) 0 0 else V 0 0 0.
Definition floor (t : R) := Z.to_nat (Int_part t).
Definition p (i : bool) (t : R) := if i then V (1 + excess (floor t) * (1 - (t - INR (floor t)) / 2)) 0 0 else V 0 0 0.

Lemma at_time k s : 0 <= s < 1 -> floor (INR k * 1 + s) = k.
Proof.
  intros H; unfold floor; rewrite Rmult_1_r.
  replace (Int_part (INR k + s)) with (Z.of_nat k); [apply Nat2Z.id |].
  unfold Int_part; rewrite <- (tech_up (INR k + s) (Z.of_nat k + 1)); try lia; rewrite plus_IZR, <- INR_IZR_INZ; lra.
Qed.

Lemma place k s : 0 <= s <= 1 -> p true (INR k * 1 + s) = V (1 + excess k * (1 - s / 2)) 0 0.
Proof.
  intros [H0 [H1 | ->]].
  - unfold p; rewrite at_time by lra; do 2 f_equal; field.
  - replace (INR k * 1 + 1) with (INR (S k) * 1 + 0) by (rewrite S_INR; ring).
    unfold p; rewrite at_time by lra; unfold excess; f_equal; simpl; field.
Qed.

(** THEOREM: A moving robot meets all hypotheses of Safety.safe_always: they do not contradict each other. *)
Theorem can_be_met : forall t, 0 <= t -> 1 <= norm (sub (p true t) (p false t)).
Proof.
  assert (P : forall k, 0 < excess k) by (intros k; apply pow_lt; lra).
  pose proof (safe_always 1 1 ltac:(lra) ltac:(lra) ltac:(lra) bool p v (fun _ => V 1 1 1) (fun _ => 0)
    (fun _ _ => norm) (fun i j => i = true /\ j = false) (fun _ _ => 1) (fun i _ => if i then 1 else 0) (fun _ _ => 0)
    (fun _ => True)) as S.
  unfold sample, distance, difference, moved, missed in S; apply S; auto; clear S.
  - intros i k s _ H; unfold moved, sample; destruct i; [rewrite place by exact H |].
    + replace (INR k * 1) with (INR k * 1 + 0) at 1 by ring; rewrite place by lra; right.
      unfold norm; transitivity (sqrt 0); [f_equal; unfold v; vectors; field | rewrite sqrt_0; ring].
    + right; unfold norm; transitivity (sqrt 0); [f_equal; unfold v, p; vectors; ring | rewrite sqrt_0; ring].
  - intros i k; destruct i; unfold v; vectors; f_equal; ring.
  - intros i j [-> ->]; split; [reflexivity | intros x; unfold norm; f_equal; vectors; ring].
  - intros i j x _; apply away_exists.
  - intros i j [-> ->]; lra.
  - intros i j k _ [-> ->]; left; specialize (P k).
    assert (N : norm (sub (p true (INR k * 1)) (p false (INR k * 1))) = 1 + excess k).
    { replace (INR k * 1) with (INR k * 1 + 0) at 1 by ring; rewrite place by lra.
      unfold norm, p; vectors; apply Rsqr_inj; [apply sqrt_pos | lra |]; rewrite Rsqr_sqrt by nra; unfold Rsqr; field. }
    exists (V 1 0 0); split; [apply away_from_point |]; repeat split.
    + unfold norm; vectors; transitivity (sqrt 1); [f_equal; ring | apply sqrt_1].
    + rewrite N; replace (INR k * 1) with (INR k * 1 + 0) at 1 by ring; rewrite place by lra.
      unfold p; vectors; f_equal; field.
    + unfold meets, distance, difference, sample; rewrite N; unfold bound, v.
      destruct Rle_dec; [lra | vectors; lra].
    + unfold meets, v; vectors; lra.
  - lra.
  - pose proof (place 0 0 ltac:(lra)) as Z; replace (INR 0 * 1 + 0) with 0 in Z by (simpl; ring); rewrite Z.
    unfold p, norm, excess; vectors; rewrite <- sqrt_1 at 1; apply sqrt_le_1_alt; lra.
Qed.
