/-
One control period keeps the safe distance, and scaling a velocity keeps the inequalities: the mathematics of
SAFE-LEMMA, SAFE-INV and SAFE-GATE (airground_drake/verify/model/avoidance/{lemma,obligations}.py) in Lean 4 with
Mathlib. docs/proofs/README.md says what corresponds to what.

NOT RUN: no Lean was at hand where this was written. It is a careful text, not evidence; the evidence of the claims are
their certificates. Whoever has Mathlib checks it with `lake env lean Step.lean`.

x is the vector from the point that is avoided to the robot at the sample, v its velocity relative to that point, held
for s in [0, h]; D = ‖x‖ > 0; the number r with ‖x‖ * r = ⟪x, v⟫ is the radial speed n.v of the claims, n = x / ‖x‖.
-/
import Mathlib.Analysis.InnerProductSpace.Basic
import Mathlib.Tactic.Linarith
import Mathlib.Tactic.Ring

open scoped InnerProductSpace

namespace AirgroundDrake

variable {E : Type*} [NormedAddCommGroup E] [InnerProductSpace ℝ E]

/-- SAFE-LEMMA: the distance on a straight line is at least its value at the start plus the time times its rate there.
Cauchy and Schwarz for x and x + s v; it holds for negative s, too. -/
theorem norm_line (x v : E) (r s : ℝ) (hx : 0 < ‖x‖) (hr : ‖x‖ * r = ⟪x, v⟫_ℝ) :
    ‖x‖ + s * r ≤ ‖x + s • v‖ := by
  have cauchy : ⟪x, x + s • v⟫_ℝ ≤ ‖x‖ * ‖x + s • v‖ := real_inner_le_norm x (x + s • v)
  have expanded : ⟪x, x + s • v⟫_ℝ = ‖x‖ * ‖x‖ + s * ⟪x, v⟫_ℝ := by
    rw [inner_add_right, real_inner_smul_right, real_inner_self_eq_norm_mul_norm]
  have product : ‖x‖ * (‖x‖ + s * r) ≤ ‖x‖ * ‖x + s • v‖ := by
    calc
      ‖x‖ * (‖x‖ + s * r) = ‖x‖ * ‖x‖ + s * (‖x‖ * r) := by ring
      _ = ⟪x, x + s • v⟫_ℝ := by rw [hr, expanded]
      _ ≤ ‖x‖ * ‖x + s • v‖ := cauchy
  exact le_of_mul_le_mul_left product hx

/-- SAFE-INV, outside (an obstacle, or q = 1 summed over a pair): D ≥ d and r ≥ -(D - d)/h keep d for s in [0, h].
The rule is written without the division. -/
theorem outside (x v : E) (r s d h : ℝ) (hx : 0 < ‖x‖) (hr : ‖x‖ * r = ⟪x, v⟫_ℝ)
    (hs : 0 ≤ s) (rest : s ≤ h) (excess : d ≤ ‖x‖) (rule : -(‖x‖ - d) ≤ h * r) :
    d ≤ ‖x + s • v‖ := by
  have line := norm_line x v r s hx hr
  rcases le_total 0 r with away | towards
  · have gained : 0 ≤ s * r := mul_nonneg hs away
    linarith
  · have fastest : h * r ≤ s * r := mul_le_mul_of_nonpos_right rest towards
    linarith

/-- SAFE-INV, inside: D ≤ d and r ≥ A (d - D) never bring the two closer. -/
theorem inside (x v : E) (r s d A : ℝ) (hx : 0 < ‖x‖) (hr : ‖x‖ * r = ⟪x, v⟫_ℝ)
    (hs : 0 ≤ s) (hA : 0 ≤ A) (deficit : ‖x‖ ≤ d) (rule : A * (d - ‖x‖) ≤ r) :
    ‖x‖ ≤ ‖x + s • v‖ := by
  have line := norm_line x v r s hx hr
  have demanded : 0 ≤ A * (d - ‖x‖) := mul_nonneg hA (by linarith)
  have gained : 0 ≤ s * r := mul_nonneg hs (by linarith)
  linarith

/-- SAFE-INV, restores: inside, the deficit after the period is at most (1 - A h) (d - D). -/
theorem restores (x v : E) (r d A h : ℝ) (hx : 0 < ‖x‖) (hr : ‖x‖ * r = ⟪x, v⟫_ℝ)
    (hh : 0 ≤ h) (rule : A * (d - ‖x‖) ≤ r) :
    d - ‖x + h • v‖ ≤ (1 - A * h) * (d - ‖x‖) := by
  have line := norm_line x v r h hx hr
  have gained : h * (A * (d - ‖x‖)) ≤ h * r := mul_le_mul_of_nonneg_left rule hh
  have same : (1 - A * h) * (d - ‖x‖) = d - ‖x‖ - h * (A * (d - ‖x‖)) := by ring
  linarith

/-- SAFE-INV, pair_outside: each of two robots takes half; ri and rj are their own radial speeds away from the other. -/
theorem pair_outside (x vi vj : E) (ri rj s d h : ℝ) (hx : 0 < ‖x‖)
    (hi : ‖x‖ * ri = ⟪x, vi⟫_ℝ) (hj : ‖x‖ * rj = -⟪x, vj⟫_ℝ)
    (hs : 0 ≤ s) (rest : s ≤ h) (excess : d ≤ ‖x‖)
    (rulei : -(‖x‖ - d) ≤ 2 * (h * ri)) (rulej : -(‖x‖ - d) ≤ 2 * (h * rj)) :
    d ≤ ‖x + s • (vi - vj)‖ := by
  have rate : ‖x‖ * (ri + rj) = ⟪x, vi - vj⟫_ℝ := by
    rw [inner_sub_right, mul_add, hi, hj]
    ring
  have rule : -(‖x‖ - d) ≤ h * (ri + rj) := by
    rw [mul_add]
    linarith
  exact outside x (vi - vj) (ri + rj) s d h hx rate hs rest excess rule

/-- SAFE-INV, unseen: beyond a range R ≥ d + c h, closing at c at most, no inequality is needed. -/
theorem unseen (x v : E) (s d h c R : ℝ) (hs : 0 ≤ s) (rest : s ≤ h) (hc : 0 ≤ c)
    (fastest : ‖v‖ ≤ c) (covers : d + c * h ≤ R) (far : R ≤ ‖x‖) :
    d ≤ ‖x + s • v‖ := by
  have way : ‖s • v‖ ≤ c * h := by
    rw [norm_smul, Real.norm_eq_abs, abs_of_nonneg hs]
    calc
      s * ‖v‖ ≤ s * c := mul_le_mul_of_nonneg_left fastest hs
      _ ≤ h * c := mul_le_mul_of_nonneg_right rest hc
      _ = c * h := mul_comm h c
  have back : ‖x‖ ≤ ‖x + s • v‖ + ‖s • v‖ := by
    calc
      ‖x‖ = ‖x + s • v - s • v‖ := by rw [add_sub_cancel_right]
      _ ≤ ‖x + s • v‖ + ‖s • v‖ := norm_sub_le (x + s • v) (s • v)
  linarith

/-- From a safe state v = 0 meets every inequality: its bound b, with h b = -q (D - d), is not positive. -/
theorem zero_outside (D d h q b : ℝ) (hh : 0 < h) (hq : 0 ≤ q) (excess : d ≤ D) (bound : h * b = -(q * (D - d))) :
    b ≤ 0 := by
  have demanded : 0 ≤ q * (D - d) := mul_nonneg hq (by linarith)
  by_contra positive
  have product : 0 < h * b := mul_pos hh (not_le.mp positive)
  linarith

/-- Scaling lemma, scaling_keeps: an inequality that v = 0 and v meet is met by every scaled σ v. -/
theorem scaling_keeps (r b σ : ℝ) (hσ : 0 ≤ σ) (at_most : σ ≤ 1) (feasible : b ≤ 0) (held : b ≤ r) :
    b ≤ σ * r := by
  have scaled : σ * b ≤ σ * r := mul_le_mul_of_nonneg_left held hσ
  have shorter : 0 ≤ (1 - σ) * (-b) := mul_nonneg (by linarith) (by linarith)
  have same : (1 - σ) * (-b) = σ * b - b := by ring
  linarith

/-- Scaling lemma, scaling_mends: one that v breaks is met from σ = b / r on, said as `ratio * r = b`. -/
theorem scaling_mends (r b σ ratio : ℝ) (feasible : b ≤ 0) (violated : r < b) (hratio : ratio * r = b)
    (least : σ ≤ ratio) :
    b ≤ σ * r := by
  have negative : r ≤ 0 := by linarith
  have scaled : ratio * r ≤ σ * r := mul_le_mul_of_nonpos_right least negative
  linarith

/-- The two together: whatever velocity has rates r k against the bounds b k, none of them positive, the velocity scaled
by any σ in [0, 1] that is at most every ratio of a broken one meets all inequalities. σ = 0 is such a number. -/
theorem scaled_meets_all {ι : Type*} (r b ratio : ι → ℝ) (σ : ℝ) (hσ : 0 ≤ σ) (at_most : σ ≤ 1)
    (feasible : ∀ k, b k ≤ 0) (hratio : ∀ k, r k < b k → ratio k * r k = b k)
    (least : ∀ k, r k < b k → σ ≤ ratio k) :
    ∀ k, b k ≤ σ * r k := by
  intro k
  rcases lt_or_ge (r k) (b k) with violated | held
  · exact scaling_mends (r k) (b k) σ (ratio k) (feasible k) violated (hratio k violated) (least k violated)
  · exact scaling_keeps (r k) (b k) σ hσ at_most (feasible k) held

end AirgroundDrake
