(** The threshold equation (19), with c2/c1 on the right, has one root, and the Bayes risk (16) is least there alone.

    That (17) and (18) are the mean decision time and the error rate of the process (15) is not proved here: THR-DDM
    compares them with simulated first passages. THR-ROOT checks the signs by which [enclosed] encloses the root. *)
Require Import Reals Lra Psatz.
Local Open Scope R_scope.

Section Threshold.

Variables drift noise c1 c2 : R.
Hypotheses (drift_positive : 0 < drift) (noise_positive : 0 < noise) (c1_positive : 0 < c1) (c2_positive : 0 < c2).

(** (17), (18) without initial deviation, (16), and the left side of (19). *)
Definition decision_time zeta := zeta / drift * tanh (zeta * drift / noise ^ 2).
Definition error_rate zeta := 1 / (1 + exp (2 * drift * zeta / noise ^ 2)).
Definition risk zeta := c1 * decision_time zeta + c2 * error_rate zeta.
Definition left_side zeta := noise ^ 2 / drift ^ 2 * sinh (2 * drift * zeta / noise ^ 2) + 2 * zeta / drift.
Definition solves zeta := left_side zeta = c2 / c1.

(** In [u = 2 drift zeta / noise^2]. *)
Definition u zeta := 2 * drift * zeta / noise ^ 2.
Definition rate := 2 * drift / noise ^ 2.
Definition scale := noise ^ 2 / (2 * drift ^ 2).

Lemma positive : 0 < rate /\ 0 < scale /\ 0 < c2 / c1.
Proof.
  pose proof (pow_lt noise 2 noise_positive); pose proof (pow_lt drift 2 drift_positive).
  unfold rate, scale; repeat split; apply Rdiv_lt_0_compat; lra.
Qed.

Lemma u_rate zeta : u zeta = rate * zeta.
Proof. unfold u, rate; field; lra. Qed.

Lemma left_u zeta : left_side zeta = scale * (exp (u zeta) - exp (- u zeta) + 2 * u zeta).
Proof.
  unfold left_side, sinh; fold (u zeta); replace (2 * zeta / drift) with (scale * (2 * u zeta))
    by (unfold scale, u; field; lra); unfold scale; field; lra.
Qed.

(** THEOREM (19): The left side of the threshold equation increases strictly.
    - drift, noise, c1 and c2 are positive. *)
Theorem increasing a b : a < b -> left_side a < left_side b.
Proof.
  intros H; rewrite !left_u; destruct positive as [Q [K _]]; apply Rmult_lt_compat_l; [exact K |].
  assert (L : u a < u b) by (rewrite !u_rate; apply Rmult_lt_compat_l; assumption).
  pose proof (exp_increasing _ _ L); assert (exp (- u b) < exp (- u a)) by (apply exp_increasing; lra); lra.
Qed.

Theorem at_most_one a b : solves a -> solves b -> a = b.
Proof.
  unfold solves; intros Ha Hb; destruct (Rtotal_order a b) as [L | [E | L]]; [| exact E |];
    apply increasing in L; lra.
Qed.

(** THEOREM (19): Two points at which the equation has different signs enclose its root.
    - drift, noise, c1 and c2 are positive.
    - The left side is below c2/c1 at the lower point and above it at the upper one. *)
Theorem enclosed low high zeta : left_side low < c2 / c1 < left_side high -> solves zeta -> low < zeta < high.
Proof.
  unfold solves; intros [L H] E; split; apply Rnot_le_lt; intros [C | C]; try subst; try apply increasing in C; lra.
Qed.

(** THEOREM (19): The threshold equation with c2/c1 on the right has exactly one root, and it is positive.
    - drift, noise, c1 and c2 are positive. *)
Theorem exactly_one : exists zeta, 0 < zeta /\ solves zeta /\ forall other, solves other -> other = zeta.
Proof.
  set (f := fun z => left_side z - c2 / c1); destruct positive as [Q [K P]].
  assert (C : continuity f) by (unfold f, left_side; reg).
  assert (F0 : f 0 < 0) by (unfold f; rewrite left_u, u_rate, Rmult_0_r, Ropp_0, exp_0; lra).
  set (far := c2 / c1 * drift); assert (L : 0 < far) by (apply Rmult_lt_0_compat; lra).
  assert (F1 : 0 < f far).
  { unfold f; rewrite left_u; assert (U : 0 < u far) by (rewrite u_rate; apply Rmult_lt_0_compat; lra).
    assert (E : exp (- u far) < exp (u far)) by (apply exp_increasing; lra).
    replace (c2 / c1) with (scale * u far) at 1 by (unfold scale, u, far; field; lra); nra. }
  destruct (IVT f 0 far C L F0 F1) as [z [[[Z | Z] _] E]]; [| rewrite <- Z in E; lra].
  exists z; assert (S : solves z) by (unfold solves; unfold f in E; lra).
  repeat split; [exact Z | exact S | intros other O; exact (at_most_one _ _ O S)].
Qed.

Lemma risk_u zeta : risk zeta = (c1 * scale * u zeta * (exp (u zeta) - 1) + c2) / (exp (u zeta) + 1).
Proof.
  unfold risk, decision_time, error_rate, tanh, sinh, cosh; fold (u zeta).
  set (a := zeta * drift / noise ^ 2); assert (U : u zeta = a + a) by (unfold u, a; field; lra).
  assert (Z : zeta / drift = scale * u zeta) by (unfold u, scale; field; lra).
  pose proof (exp_pos a); rewrite Z, U, exp_plus, exp_Ropp; field; repeat split; nra.
Qed.

(** How much larger the risk is elsewhere: two terms of the form [exp t - (1 + t)]. *)
Lemma risk_difference zeta other : solves zeta -> let x := u other in let t := x - u zeta in
  risk other - risk zeta = c1 * scale * (exp x * (exp (- t) - (1 + - t)) + (exp t - (1 + t))) / (exp x + 1).
Proof.
  intros S x t; unfold solves in S; rewrite !risk_u; fold x; rewrite left_u in S; destruct positive as [Q [K _]].
  set (w := u zeta) in *; set (k := c1 * scale); pose proof (exp_pos x) as X; pose proof (exp_pos w) as W.
  assert (C2 : c2 = k * (exp w - exp (- w) + 2 * w)) by (unfold k; rewrite Rmult_assoc, S; field; lra).
  assert (E3 : exp x * exp (- t) = exp w) by (rewrite <- exp_plus; f_equal; unfold t; ring).
  assert (E4 : exp t = exp x * exp (- w)) by (rewrite <- exp_plus; f_equal; unfold t; ring).
  assert (E5 : exp w * exp (- w) = 1) by (rewrite <- exp_plus, Rplus_opp_r; apply exp_0).
  assert (B : (k * w * (exp w - 1) + c2) / (exp w + 1) = k * (w + 1 - exp (- w))).
  { apply Rmult_eq_reg_r with (exp w + 1); [| lra]; transitivity (k * w * (exp w - 1) + c2); [field; lra |].
    rewrite C2; transitivity (k * (w * exp w + w + exp w + 1 - exp w * exp (- w) - exp (- w))); [rewrite E5 |]; ring. }
  replace (exp x * (exp (- t) - (1 + - t))) with (exp w - exp x * (1 - t)) by (rewrite <- E3; ring).
  rewrite B, E4, C2; unfold t; field; lra.
Qed.

(** No derivatives, only [1 + t < exp t]. *)
(** THEOREM (16)-(19): The Bayes risk is strictly least at the root.
    - drift, noise, c1 and c2 are positive.
    - There is no initial deviation. *)
Theorem least zeta other : solves zeta -> other <> zeta -> risk zeta < risk other.
Proof.
  intros S N; pose proof (risk_difference zeta other S) as D; cbv zeta in D; destruct positive as [Q [K _]].
  set (x := u other) in *; set (t := x - u zeta) in *; pose proof (exp_pos x) as X.
  assert (T : t <> 0) by (unfold t, x; rewrite !u_rate; nra).
  pose proof (exp_ineq1 t T); pose proof (exp_ineq1 (- t) ltac:(lra)).
  enough (0 < risk other - risk zeta) by lra; rewrite D; apply Rdiv_lt_0_compat; [| lra].
  apply Rmult_lt_0_compat; [apply Rmult_lt_0_compat; lra |].
  apply Rplus_lt_0_compat; [apply Rmult_lt_0_compat |]; lra.
Qed.

(** THEOREM (19): The root of the printed equation, with c1/c2, has a higher risk.
    - drift, noise, c1 and c2 are positive.
    - c1 and c2 differ. *)
Corollary printed_is_worse zeta printed : solves zeta -> left_side printed = c1 / c2 -> c1 <> c2 ->
  risk zeta < risk printed.
Proof.
  intros S P N; apply least; [exact S |]; intros ->; unfold solves in S; rewrite S in P; apply N.
  assert (Q : c2 * c2 = c1 * c1).
  { apply (f_equal (fun q => q * c1 * c2)) in P; field_simplify in P; lra || nra. }
  nra.
Qed.

(** ** With an initial deviation, (17)-(18), it is not the minimum: a threshold nearby is better. *)
Definition bias zeta y := (1 - exp (- u y)) / (2 * sinh (u zeta)).
Definition decision_time_from y zeta := decision_time zeta + 2 * zeta / drift * bias zeta y - y / drift.
Definition error_rate_from y zeta := error_rate zeta - bias zeta y.
Definition risk_from y zeta := c1 * decision_time_from y zeta + c2 * error_rate_from y zeta.

Definition twice_sinh x := exp x - exp (- x).

Lemma twice_sinh_increasing a b : a < b -> twice_sinh a < twice_sinh b.
Proof.
  intros H; unfold twice_sinh; pose proof (exp_increasing _ _ H).
  assert (exp (- b) < exp (- a)) by (apply exp_increasing; lra); lra.
Qed.

Lemma twice_sinh_positive x : 0 < x -> 0 < twice_sinh x.
Proof. intros H; apply twice_sinh_increasing in H; unfold twice_sinh in *; rewrite Ropp_0 in H; lra. Qed.

Lemma risk_from_difference y zeta other : solves zeta -> 0 < zeta -> 0 < other ->
  let t := u other - u zeta in let k := c1 * scale in let b := 1 - exp (- u y) in
  risk_from y other - risk_from y zeta = risk other - risk zeta
    + b * k * (2 * t + (twice_sinh (u other) - twice_sinh (u zeta))) / twice_sinh (u other).
Proof.
  intros S Z O t k b; unfold solves in S; rewrite left_u in S; destruct positive as [Q [K _]].
  assert (U : forall z, 0 < z -> 0 < twice_sinh (u z)).
  { intros z Hz; apply twice_sinh_positive; rewrite u_rate; apply Rmult_lt_0_compat; assumption. }
  assert (C2 : c2 = k * (twice_sinh (u zeta) + 2 * u zeta)).
  { unfold k, twice_sinh; rewrite Rmult_assoc, S; field; lra. }
  assert (E : forall z, 0 < z -> risk_from y z = risk z + b * (2 * k * u z - c2) / twice_sinh (u z) - c1 * y / drift).
  { intros z Hz; specialize (U z Hz).
    unfold risk_from, decision_time_from, error_rate_from, risk, bias, sinh, twice_sinh in *.
    replace (2 * z / drift) with (2 * scale * u z) by (unfold scale, u; field; lra).
    unfold b, k; field; lra. }
  rewrite !E by assumption; rewrite C2; pose proof (U zeta Z); pose proof (U other O); unfold t; field; lra.
Qed.

(** Near the root the risk without deviation rises by the square only. *)
Lemma risk_near zeta other : solves zeta -> let t := u other - u zeta in - (1 / 2) <= t <= 1 / 2 ->
  risk other - risk zeta <= c1 * scale * (2 * (t * t)).
Proof.
  intros S t T; pose proof (risk_difference zeta other S) as D; cbv zeta in D; fold t in D; rewrite D.
  destruct positive as [_ [K _]]; pose proof (exp_pos (u other)) as X; set (e := exp (u other)) in *.
  assert (B : forall r, - (1 / 2) <= r <= 1 / 2 -> exp r - (1 + r) <= 2 * (r * r)).
  { intros r Hr; pose proof (exp_ineq1_le (- r)) as L; assert (P : exp r * exp (- r) = 1)
      by (rewrite <- exp_plus, Rplus_opp_r; apply exp_0).
    pose proof (exp_pos r); assert (exp r * (1 - r) <= 1) by nra; nra. }
  pose proof (B t T); pose proof (B (- t) ltac:(lra)).
  apply Rmult_le_reg_r with (e + 1); [lra |]; unfold Rdiv; rewrite Rmult_assoc, Rinv_l, Rmult_1_r by lra.
  assert (k_positive : 0 < c1 * scale) by (apply Rmult_lt_0_compat; lra); set (k := c1 * scale) in *.
  rewrite (Rmult_assoc k (2 * (t * t))); apply Rmult_le_compat_l; [lra | nra].
Qed.

Lemma better k b t g X : 0 < k -> 0 < X -> b * t < 0 -> b * g <= 0 -> t * t * X < - (b * t) ->
  k * (2 * (t * t)) + b * k * (2 * t + g) / X < 0.
Proof.
  intros K HX T G H; apply Rmult_lt_reg_r with X; [exact HX |].
  replace ((k * (2 * (t * t)) + b * k * (2 * t + g) / X) * X) with (k * (2 * (t * t * X + b * t) + b * g))
    by (field; lra); nra.
Qed.

(** THEOREM (17)-(19): With any initial deviation the risk is lower at some other threshold than at the root.
    - drift, noise, c1 and c2 are positive.
    - The deviation is not 0 and smaller than the root. *)
Theorem not_least_with_deviation y zeta : solves zeta -> y <> 0 -> Rabs y < zeta ->
  exists other, Rabs y < other /\ risk_from y other < risk_from y zeta.
Proof.
  intros S N Y; pose proof (Rabs_pos y); destruct positive as [Q [K _]].
  assert (k_positive : 0 < c1 * scale) by (apply Rmult_lt_0_compat; lra).
  assert (W : u (Rabs y) < u zeta) by (rewrite !u_rate; apply Rmult_lt_compat_l; assumption).
  assert (Y0 : 0 <= u (Rabs y)) by (rewrite u_rate; apply Rmult_le_pos; lra).
  set (w := u zeta) in *; set (b := 1 - exp (- u y)); set (M := twice_sinh (w + 1 / 2)).
  assert (HM : 0 < M) by (apply twice_sinh_positive; lra).
  assert (E : forall t, - (1 / 2) <= t <= 1 / 2 -> u (Rabs y) < w + t -> b * t < 0 -> t * t * M < - (b * t) ->
    exists other, Rabs y < other /\ risk_from y other < risk_from y zeta).
  { intros t T V B C; exists (zeta + t / rate); set (other := zeta + t / rate).
    assert (U : u other = w + t) by (unfold w, other; rewrite !u_rate; field; lra).
    assert (O : Rabs y < other) by (apply Rmult_lt_reg_l with rate; [lra | rewrite <- !u_rate, U; exact V]).
    split; [exact O |]; pose proof (risk_from_difference y zeta other S ltac:(lra) ltac:(lra)) as D.
    pose proof (risk_near zeta other S) as R; cbv zeta in D, R; rewrite !U in *; fold w b in D, R.
    replace (w + t - w) with t in * by ring; specialize (R T).
    set (X := twice_sinh (w + t)) in *; assert (HX : 0 < X) by (apply twice_sinh_positive; lra).
    assert (XM : X <= M).
    { destruct (Rle_lt_or_eq_dec t (1 / 2) (proj2 T)) as [L | L]; [left; apply twice_sinh_increasing; lra |].
      unfold X, M; rewrite L; lra. }
    assert (G : b * (X - twice_sinh w) <= 0).
    { destruct (Rtotal_order t 0) as [L | [L | L]]; [| rewrite L in B; lra |].
      - assert (X < twice_sinh w) by (apply twice_sinh_increasing; lra); nra.
      - assert (twice_sinh w < X) by (apply twice_sinh_increasing; lra); nra. }
    pose proof (better (c1 * scale) b t (X - twice_sinh w) X k_positive HX B G ltac:(nra)); lra. }
  assert (Hb : b <> 0 /\ b * y > 0).
  { unfold b; destruct (Rtotal_order y 0) as [L | [L | L]]; [| contradiction |].
    - assert (exp 0 < exp (- u y)) by (apply exp_increasing; rewrite u_rate; nra); rewrite exp_0 in *; split; nra.
    - assert (exp (- u y) < exp 0) by (apply exp_increasing; rewrite u_rate; nra); rewrite exp_0 in *; split; nra. }
  destruct Hb as [Hb _]; set (r := Rmin (1 / 2) (Rmin (Rabs b / (2 * M)) ((w - u (Rabs y)) / 2))).
  pose proof (Rabs_pos_lt b Hb) as Pb; assert (R0 : 0 < r).
  { repeat apply Rmin_glb_lt; [lra | apply Rdiv_lt_0_compat | ]; lra. }
  assert (R1 : r <= 1 / 2) by apply Rmin_l.
  assert (R2 : r * (2 * M) <= Rabs b).
  { apply Rle_trans with (Rabs b / (2 * M) * (2 * M)); [| right; field; lra].
    apply Rmult_le_compat_r; [lra | eapply Rle_trans; [apply Rmin_r | apply Rmin_l]]. }
  assert (R3 : r <= (w - u (Rabs y)) / 2) by (eapply Rle_trans; [apply Rmin_r | apply Rmin_r]).
  unfold Rabs in R2, Pb; destruct (Rcase_abs b) as [L | L]; [apply (E r) | apply (E (- r))]; try lra; nra.
Qed.

End Threshold.

(** * One threshold is the optimum for two drifts at most: [sinh u + u] and [K u^2] meet twice at most *)
Lemma sinh_increasing a b : a < b -> sinh a < sinh b.
Proof.
  intros H; unfold sinh; pose proof (exp_increasing _ _ H).
  assert (exp (- b) < exp (- a)) by (apply exp_increasing; lra); lra.
Qed.

Lemma at_most_two K a b c : 0 < a -> a < b -> b < c ->
  sinh a + a = K * Rsqr a -> sinh b + b = K * Rsqr b -> sinh c + c = K * Rsqr c -> False.
Proof.
  intros A B C Ea Eb Ec.
  set (f := fun u => sinh u + u - K * Rsqr u); set (f' := fun u => cosh u + 1 - K * (2 * u)).
  set (f'' := fun u => sinh u + 0 - K * 2).
  assert (D : forall u, derivable_pt_lim f u (f' u)).
  { intros u; apply (derivable_pt_lim_minus (fun u => sinh u + u) (fun u => K * Rsqr u)).
    - apply (derivable_pt_lim_plus sinh id); [apply derivable_pt_lim_sinh | apply derivable_pt_lim_id].
    - apply (derivable_pt_lim_scal Rsqr), derivable_pt_lim_Rsqr. }
  assert (D' : forall u, derivable_pt_lim f' u (f'' u)).
  { intros u; apply (derivable_pt_lim_minus (fun u => cosh u + 1) (fun u => K * (2 * u))).
    - apply (derivable_pt_lim_plus cosh (fct_cte 1)); [apply derivable_pt_lim_cosh | apply derivable_pt_lim_const].
    - replace (K * 2) with (K * (2 * 1)) by ring.
      apply (derivable_pt_lim_scal (fun u => 2 * u)), (derivable_pt_lim_scal id), derivable_pt_lim_id. }
  assert (Rolle : forall g g' x y, (forall u, derivable_pt_lim g u (g' u)) -> x < y -> g x = g y ->
    exists u, g' u = 0 /\ x < u < y).
  { intros g g' x y L H E; destruct (MVT_cor2 g g' x y H (fun u _ => L u)) as [u [M I]]; exists u; split; [| exact I].
    apply Rmult_eq_reg_r with (y - x); lra. }
  assert (Z : f 0 = 0) by (unfold f; rewrite sinh_0, Rsqr_0; ring).
  assert (Fa : f a = 0) by (unfold f; lra); assert (Fb : f b = 0) by (unfold f; lra).
  assert (Fc : f c = 0) by (unfold f; lra).
  destruct (Rolle f f' 0 a D A ltac:(lra)) as [u [U Iu]], (Rolle f f' a b D B ltac:(lra)) as [v [V Iv]].
  destruct (Rolle f f' b c D C ltac:(lra)) as [w [W Iw]].
  destruct (Rolle f' f'' u v D' ltac:(lra) ltac:(lra)) as [x [X Ix]].
  destruct (Rolle f' f'' v w D' ltac:(lra) ltac:(lra)) as [y [Y Iy]].
  pose proof (sinh_increasing x y ltac:(lra)); unfold f'' in X, Y; lra.
Qed.

(** THEOREM (19): One threshold is the root of the equation for at most two drifts.
    - noise and threshold are positive. *)
Theorem at_most_two_drifts noise c1 c2 zeta m1 m2 m3 : 0 < noise -> 0 < zeta -> 0 < m1 -> m1 < m2 -> m2 < m3 ->
  solves m1 noise c1 c2 zeta -> solves m2 noise c1 c2 zeta -> solves m3 noise c1 c2 zeta -> False.
Proof.
  intros N Z A B C S1 S2 S3; pose proof (pow_lt noise 2 N) as N2; set (n := noise ^ 2) in *.
  set (k := 2 * zeta / n); set (K := c2 / c1 / (n * Rsqr k)).
  assert (k_positive : 0 < k) by (apply Rdiv_lt_0_compat; lra).
  assert (E : forall m, 0 < m -> solves m noise c1 c2 zeta -> sinh (k * m) + k * m = K * Rsqr (k * m)).
  { intros m M S; unfold solves, left_side in S; fold n in S; unfold K; rewrite <- S, Rsqr_mult.
    replace (2 * m * zeta / n) with (k * m) by (unfold k; field; lra).
    generalize (sinh (k * m)); intros y; unfold k, Rsqr; field; repeat split; lra. }
  apply (at_most_two K (k * m1) (k * m2) (k * m3)).
  - apply Rmult_lt_0_compat; lra.
  - apply Rmult_lt_compat_l; lra.
  - apply Rmult_lt_compat_l; lra.
  - apply E; [lra | exact S1].
  - apply E; [lra | exact S2].
  - apply E; [lra | exact S3].
Qed.
