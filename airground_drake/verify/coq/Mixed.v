(** One theorem for a run: any bodies, each with its own plant, and a table of pairs.

    An entry of the table says of a pair from which sample on, and for how many periods, its hypotheses were [checked].
    [run_all]: every entry that was checked keeps its [promise], whatever is true of other entries. A pair that misses a
    hypothesis in a period gets an entry up to that period, and another one from a later sample on: of the period itself
    nothing is said. The kinds of entries:
      [Together]    two bodies that both obey the law, or one and a set at rest (the body [rest]);
      [Lagging]     the same, of bodies whose velocities lag: better than a cover;
      [Forwards]    a unicycle that never drives backwards, and a set at rest: better than a cover;
      [Moving]      a robot and a convex set that moves as it likes;
      [Retreating]  the same, where the robot retreats as fast as the set approaches. *)
Require Import Reals Lra Psatz List Lia.
Require Import Safety Convex Budget Pieces Plants Passive.
Import ListNotations.
Local Open Scope R_scope.

Section Mixed.

Variable h : R.
Hypothesis h_positive : 0 < h.
Notation sample := (sample h).

(** * Bodies *)

(** The point that the law steers, m; the centre of the body, m; the commands, m/s; and by how much the plant is off:
    drift, m/s, dip and cover, m. *)
Record body :=
  Body { steered : R -> vec; place : R -> vec; command : nat -> vec; drift : R; dip : R; cover : R }.

(** What is checked of a body in the period [k]. *)
Definition conforms b k := forall s, 0 <= s <= h ->
  let off := sub (sub (steered b (sample k + s)) (steered b (sample k))) (scale s (command b k)) in
  norm off <= drift b * s + dip b /\ (s = h -> norm off <= drift b * h) /\
  norm (sub (place b (sample k + s)) (steered b (sample k + s))) <= cover b.

(** ** Which plants conform *)
Lemma near_itself f (a : vec) : 0 <= f -> norm (sub a a) <= f.
Proof. intros F; replace (sub a a) with (V 0 0 0) by (vectors; f_equal; ring); rewrite norm_0; exact F. Qed.

(** A body that moves exactly as commanded. *)
Lemma exactly b k :
  (forall s, 0 <= s <= h -> sub (steered b (sample k + s)) (steered b (sample k)) = scale s (command b k)) ->
  (forall s, 0 <= s <= h -> norm (sub (place b (sample k + s)) (steered b (sample k + s))) <= cover b) ->
  0 <= drift b -> 0 <= dip b -> conforms b k.
Proof.
  intros E C D1 D2 s Hs; rewrite (E s Hs); cbv zeta; specialize (C s Hs).
  split; [apply near_itself; nra | split; [intros _; apply near_itself; nra | exact C]].
Qed.

(** THEOREM: A body that moves as commanded conforms to every drift, dip and cover.
    - They are not negative. *)
Lemma first_order b k :
  (forall s, 0 <= s <= h -> sub (steered b (sample k + s)) (steered b (sample k)) = scale s (command b k)) ->
  (forall t, place b t = steered b t) -> 0 <= drift b -> 0 <= dip b -> 0 <= cover b -> conforms b k.
Proof. intros E P D1 D2 C; apply exactly; auto; intros s _; rewrite P; apply near_itself, C. Qed.

(** THEOREM: A body whose velocity errs by w conforms to the drift w; and a set that moves at V, with the command 0, to
    V.
    - Dip and cover are not negative. *)
Lemma drifting b k : (forall s, 0 <= s <= h ->
    norm (sub (sub (steered b (sample k + s)) (steered b (sample k))) (scale s (command b k))) <= drift b * s) ->
  (forall t, place b t = steered b t) -> 0 <= dip b -> 0 <= cover b -> conforms b k.
Proof.
  intros E P D2 C s Hs; specialize (E s Hs); cbv zeta; rewrite P; split; [lra | split; [intros <-; exact E |]].
  apply near_itself, C.
Qed.

(** The centre of a unicycle is its axle. *)
(** THEOREM: A unicycle with chord steering conforms to no drift, the cover l and the dip |omega| |(v, l omega)| h^2/8.
    - Speed and turning rate are those of chord steering, and constant in a period.
    - Positions do not jump, and have the plant's derivatives inside the periods.
    Silent on: Slip: it may be declared as a drift of a user's plant. *)
Lemma unicycle_chord b k th om v l a c : 0 < l -> chord_steering l h a c om v -> command b k = turn th a c ->
  goes (fun r => steered b (sample k + r)) (fun r => turn (th + om * r) v (l * om)) h ->
  (forall s, 0 <= s <= h -> steered b (sample k + s) = add (place b (sample k + s)) (turn (th + om * s) l 0)) ->
  0 <= drift b -> Rabs om * speed v (l * om) * (h * h) / 8 <= dip b -> l <= cover b -> conforms b k.
Proof.
  intros Hl C U G P D1 D2 D3.
  destruct (chord (fun r => steered b (sample k + r)) th om v l h a c h_positive C G) as [A B]; cbv beta in A, B.
  rewrite Rplus_0_r, <- U in A, B; intros s Hs; cbv zeta; split; [specialize (B s Hs); nra | split].
  - intros ->; rewrite A; apply near_itself; nra.
  - rewrite (P s Hs); set (q := turn (th + om * s) l 0).
    replace (sub (place b (sample k + s)) (add (place b (sample k + s)) q)) with (scale (-1) q)
      by (apply vec_eq; vectors; ring); rewrite norm_opposite; unfold q; rewrite norm_ahead; lra.
Qed.

(** THEOREM: A body with lag conforms to no drift, no dip and the cover tau V.
    - The velocity goes towards the command at the rate (u - v)/tau.
    - It is no faster than V.
    - Positions do not jump, and have the plant's derivatives inside the periods. *)
Lemma lagging b k v tau top : 0 < tau -> (forall t, steered b t = add (place b t) (scale tau (v t))) ->
  goes (fun r => place b (sample k + r)) (fun r => v (sample k + r)) h ->
  goes (fun r => v (sample k + r)) (fun r => scale (/ tau) (sub (command b k) (v (sample k + r)))) h ->
  (forall s, 0 <= s <= h -> norm (v (sample k + s)) <= top) ->
  0 <= drift b -> 0 <= dip b -> tau * top <= cover b -> conforms b k.
Proof.
  intros Ht Z Gp Gv Top D1 D2 D3; apply exactly; auto; intros s Hs.
  - pose proof (lag h _ _ (command b k) tau s Ht Gp Gv Hs) as P; cbv beta in P.
    rewrite Rplus_0_r, <- !Z in P; exact P.
  - rewrite Z; specialize (Top s Hs); set (p := place b (sample k + s)); set (w := v (sample k + s)) in *.
    replace (sub p (add p (scale tau w))) with (scale (-1) (scale tau w)) by (apply vec_eq; vectors; ring).
    rewrite norm_opposite, norm_scale by lra; nra.
Qed.

(** Input delay [delta]: the law steers the point where the body will be when all commands on their way have been
    carried out. The entry may be about the places of bodies [wait] later, for a pair one of its delays: then equal
    delays cost nothing, and nor does a delay beside a set at rest. *)
(** THEOREM: A body with a delay conforms to no drift, no dip and the cover V |wait - delay|, as it is `wait` later.
    - The law steers the point where the body will be after the commands on their way.
    - They are no faster than V. *)
Lemma delayed b k p delta wait top :
  (forall s, 0 <= s <= h -> sub (steered b (sample k + s)) (steered b (sample k)) = scale s (command b k)) ->
  (forall t, p (t + delta) = steered b t) -> (forall t, place b t = p (t + wait)) ->
  (forall s, 0 <= s <= h -> norm (sub (steered b (sample k + s + (wait - delta))) (steered b (sample k + s)))
    <= top * Rabs (wait - delta)) ->
  0 <= drift b -> 0 <= dip b -> top * Rabs (wait - delta) <= cover b -> conforms b k.
Proof.
  intros E P W Top D1 D2 D3; apply exactly; auto; intros s Hs; apply Rle_trans with (2 := D3); rewrite W.
  apply (delay p (steered b)); auto.
Qed.

(** A set at rest: a body at the origin of the set. *)
Definition rest := let o := V 0 0 0 in Body (fun _ => o) (fun _ => o) (fun _ => o) 0 0 0.

Lemma rest_conforms k : conforms rest k.
Proof. apply first_order; simpl; intros; try lra; vectors; f_equal; ring. Qed.

(** * Pairs *)

(** A body with lag: its velocity, its time constant (0: none), the limit of its speed. *)
Record motor := Motor { velocity_of : R -> vec; tau_of : R; top_of : R }.

(** Numbers of the budget, see Budget.v: gain, distance of the law, error, [short] and [loss]. *)
Record numbers := Numbers { gain : R; dlaw : R; err : R; short : R; loss : R }.

(** [d]: the distance promised. [m]: what the points keep after which the bodies are drawn. [e], [L], [Vo] and the
    retreats [r]: see Passive.v. The set [inside] at rest has [rest] for the body [j]. *)
Inductive pair :=
| Together (i j : body) (inside : vec -> Prop) (n : numbers) (d : R)
| Lagging (i j : body) (mi mj : motor) (inside : vec -> Prop) (n : numbers) (m d tau Vrel : R)
| Forwards (i : body) (th : R -> R) (v : nat -> R) (l : R) (inside : vec -> Prop) (n : numbers) (m d : R)
| Moving (i : body) (o : R -> vec) (gap : vec -> R) (e L d Vo : R) (r : nat -> R)
| Retreating (i : body) (o : R -> vec) (gap : vec -> R) (e L m Vo : R) (r : nat -> R).

(** The pair [what], for [many] periods from the sample [first] on. *)
Record entry := Entry { first : nat; many : nat; what : pair }.

Definition apart i j t := sub (steered i t) (steered j t).
Definition kept_by n := dlaw n - err n - loss n / gain n.

(** The law of two bodies at sample [k]: it is met, with the relative position measured up to [err]; or they are far
    apart; or both stand. *)
Definition pair_law i j inside n k :=
  (exists w y m, norm (sub w (apart i j (sample k))) <= err n /\ nearest inside w y m /\
    bound h (gain n) (dlaw n) (norm (sub w y)) - short n <= dot m (command i k) - dot m (command j k)) \/
  clear inside (kept_by n + (norm (command i k) + drift i + norm (command j k) + drift j) * h) (apart i j (sample k)) \/
  (forall s, 0 <= s <= h ->
    steered i (sample k + s) = steered i (sample k) /\ steered j (sample k + s) = steered j (sample k)).

(** What is computed before the run: the formula of the budget, and its condition. *)
Definition budgeted i j n d := 0 < gain n /\ gain n * h <= 1 /\ 0 <= err n < kept_by n /\
  err n * (1 - gain n * h) <= gain n * h * kept_by n /\ short n + drift i + drift j <= loss n /\ 0 <= loss n /\
  0 <= d + cover i + cover j + dip i + dip j /\
  err n + loss n / gain n + sqrt ((d + cover i + cover j + dip i + dip j) ^ 2 + err n ^ 2) <= dlaw n.

Definition checked_together i j inside n d K N := budgeted i j n d /\
  clear inside (kept_by n) (apart i j (sample K)) /\
  forall k, (K <= k < K + N)%nat -> conforms i k /\ conforms j k /\ pair_law i j inside n k.

(** The same with another point in the place of the body: a hand point, or where a body with lag would come to rest. *)
Definition with_point b q := Body (steered b) q (command b) (drift b) (dip b) (cover b).
Definition hand b th l := with_point b (fun t => add (place b t) (turn (th t) l 0)).
Definition ahead b m := with_point b (fun t => add (place b t) (scale (tau_of m) (velocity_of m t))).

(** What is left of [m], see [lag_pair] in Plants.v. *)
Definition left m mi mj tau := m - Rabs (tau_of mi - tau) * top_of mi - Rabs (tau_of mj - tau) * top_of mj.
Definition drawn b a := sqrt (b * b - a * a).

Definition checked_moving i o gap e L r K N := (forall x, exists n, away gap x n) /\ 0 <= drift i /\
  forall k, (K <= k < K + N)%nat ->
    conforms i k /\ lawful h L e gap (r k) (sub (steered i (sample k)) (o (sample k))) (command i k).

Definition checked (c : entry) := let K := first c in let N := many c in
  match what c with
  | Together i j inside n d => checked_together i j inside n d K N
  | Lagging i j mi mj inside n m d tau Vrel =>
      checked_together (ahead i mi) (ahead j mj) inside n m K N /\ 0 < tau /\ 0 <= d /\
      sqrt (d ^ 2 + (tau * Vrel) ^ 2) <= left m mi mj tau /\
      clear inside (drawn (left m mi mj tau) (tau * Vrel)) (sub (place i (sample K)) (place j (sample K))) /\
      forall k, (K <= k < K + N)%nat ->
        goes (fun r => place i (sample k + r)) (fun r => velocity_of mi (sample k + r)) h /\
        goes (fun r => place j (sample k + r)) (fun r => velocity_of mj (sample k + r)) h /\
        forall s, 0 < s < h -> let t := sample k + s in
          norm (velocity_of mi t) <= top_of mi /\ norm (velocity_of mj t) <= top_of mj /\
          norm (sub (velocity_of mi t) (velocity_of mj t)) <= Vrel
  | Forwards i th v l inside n m d =>
      checked_together (hand i th l) rest inside n m K N /\ 0 < l /\ 0 <= d /\ 0 <= m /\ sqrt (d ^ 2 + l ^ 2) <= m /\
      clear inside (drawn m l) (place i (sample K)) /\
      forall k, (K <= k < K + N)%nat ->
        0 <= v k /\ goes (fun r => place i (sample k + r)) (fun r => turn (th (sample k + r)) (v k) 0) h
  | Moving i o gap e L d Vo r => 0 <= Vo /\ d + cover i + dip i + (drift i + Vo) * h <= L /\
      checked_moving i o gap e L r K N
  | Retreating i o gap e L m Vo r => 0 <= Vo /\ m <= L - (drift i + Vo) * h /\
      m <= gap (sub (steered i (sample K)) (o (sample K))) /\ checked_moving i o gap e L r K N /\
      forall k, (K <= k < K + N)%nat -> drift i + Vo <= r k /\
        forall s, 0 <= s <= h -> norm (sub (o (sample k + s)) (o (sample k))) <= Vo * s
  end.

(** Of every period of the entry. [Moving]: (1) had the set stood still since the sample, the robot would not have come
    below the limit; (2) a period that starts at the limit keeps [d], if the set is no faster than [Vo]; (3) since the
    first sample of the entry, what is lost is at most the way of the set and the drift of the robot. *)
Definition promise (c : entry) := forall k s, (first c <= k < first c + many c)%nat -> 0 <= s <= h ->
  let t := sample k + s in let K := first c in
  match what c with
  | Together i j inside _ d | Lagging i j _ _ inside _ _ d _ _ => clear inside d (sub (place i t) (place j t))
  | Forwards i _ _ _ inside _ _ d => clear inside d (place i t)
  | Moving i o gap e L d Vo r => let D q := gap (sub (steered i (sample q)) (o (sample q))) in
      Rmin (D k) L - drift i * s - dip i - cover i <= gap (sub (place i t) (o (sample k))) /\
      (L <= D k -> norm (sub (o t) (o (sample k))) <= Vo * s -> d <= gap (sub (place i t) (o t))) /\
      (forall m, m <= L -> m <= D K -> m - sum (way h o) K (k - K) - INR (k - K) * h * drift i
        - drift i * s - dip i - cover i - norm (sub (o t) (o (sample k))) <= gap (sub (place i t) (o t)))
  | Retreating i o gap e L m Vo r => m - dip i - cover i <= gap (sub (place i t) (o t))
  end.

(** ** Two bodies that obey: the budget *)
Lemma together i j inside n d K N : checked_together i j inside n d K N ->
  forall k s, (K <= k < K + N)%nat -> 0 <= s <= h ->
  clear inside d (sub (place i (sample k + s)) (place j (sample k + s))).
Proof.
  intros [[A0 [A1 [E [G [W [W0 [D0 D]]]]]]] [H0 H]] k s Hk Hs; set (who := fun b : bool => if b then i else j).
  assert (C : forall b q, (K <= q < K + N)%nat -> conforms (who b) q).
  { intros b q Hq; destruct (H q Hq) as [Ci [Cj _]]; destruct b; assumption. }
  apply (budget h (gain n) h_positive A0 A1 bool (fun b => steered (who b)) (fun b => place (who b))
    (fun b => command (who b)) (fun b => drift (who b)) (fun b => dip (who b)) (fun b => cover (who b))
    (fun a b => a = true /\ b = false) (fun _ _ => inside) (fun _ _ => dlaw n) (fun _ _ => err n) (fun _ _ => short n)
    (fun _ _ => loss n) K (fun q => (K <= q < K + N)%nat)) with (i := true) (j := false); auto; try (intros; lia).
  - intros b q r Hq Hr; apply (C b q Hq r Hr).
  - intros b q Hq; apply (C b q Hq h); lra.
  - intros b q r Hq Hr; apply (C b q Hq r Hr).
  - intros a b [-> ->]; split; assumption.
  - intros a b q Hq [-> ->] _; destruct (H q Hq) as [_ [_ [L | [F | St]]]]; [left; exact L | right; left; exact F |].
    right; right; intros r Hr; unfold moved; simpl; destruct (St r Hr) as [-> ->]; vectors; f_equal; ring.
Qed.

(** The sum of a constant. *)
Lemma sum_plus f a K n : sum (fun q => a + f q) K n = INR n * a + sum f K n.
Proof. induction n as [| n IH]; [simpl; ring |]; rewrite S_INR; simpl sum; rewrite IH; ring. Qed.

(** THEOREM: An entry of a run's table that was checked keeps its promise, whatever is true of the others.
    - Those of its kind: the law in its periods, the plants of its two bodies, and the numbers of its budget.
    Silent on: Anything about a pair or a period that no entry is about. *)
Theorem entry_keeps (c : entry) : checked c -> promise c.
Proof.
  destruct c as [K N p]; unfold checked, promise; simpl.
  destruct p as [i j inside n d | i j mi mj inside n m d tau Vrel | i th v l inside n m d | i o gap e L d Vo r
    | i o gap e L m Vo r]; intros H k s Hk Hs.
  - exact (together i j inside n d K N H k s Hk Hs).
  - destruct H as [H [Ht [Hd [B [H0 G]]]]]; set (a := tau * Vrel) in *; set (b := left m mi mj tau) in *.
    assert (B0 : 0 <= b) by (apply Rle_trans with (2 := B), sqrt_pos).
    enough (P : clear inside (drawn b a) (sub (place i (sample k + s)) (place j (sample k + s)))).
    { intros c Hc; specialize (P c Hc); assert (Q : d <= drawn b a) by exact (lag_needs d a b Hd B); lra. }
    apply (lag_pair h K N h_positive inside (place i) (place j) (velocity_of mi) (velocity_of mj) (tau_of mi) (tau_of
      mj)
      tau (top_of mi) (top_of mj) Vrel m Ht); try assumption.
    + intros q Hq; destruct (G q Hq) as [Gi [Gj _]]; split; assumption.
    + intros q r Hq Hr; destruct (G q Hq) as [_ [_ S]]; apply S, Hr.
    + intros q r Hq Hr; exact (together _ _ inside n m K N H q r Hq Hr).
  - destruct H as [H [Hl [Hd [Hm [B [H0 G]]]]]].
    enough (P : clear inside (drawn m l) (place i (sample k + s))).
    { intros c Hc; specialize (P c Hc); assert (Q : d <= drawn m l) by exact (lag_needs d l m Hd B); lra. }
    apply (forwards h K N h_positive inside (place i) th v l m); try assumption.
    intros q r Hq Hr t c Hc; unfold t; pose proof (together _ _ inside n m K N H q r Hq Hr c Hc) as P; simpl in P.
    match type of P with _ <= norm (sub ?x c) => match goal with |- _ <= norm (sub ?y c) =>
      replace y with x by (apply vec_eq; vectors; ring) end end; exact P.
  - destruct H as [HV [HL [Cv [W H]]]]; set (D := fun q => gap (sub (steered i (sample q)) (o (sample q)))).
    destruct (H k Hk) as [C O]; destruct (C s Hs) as [T [_ Co]].
    assert (Own : Rmin (D k) L - (drift i * s + dip i) - cover i <= gap (sub (place i (sample k + s)) (o (sample k))))
      by (apply (own_doing h L e gap h_positive Cv (steered i) (place i) o (command i) r k); assumption).
    change (gap (sub (steered i (sample k)) (o (sample k)))) with (D k).
    change (gap (sub (steered i (sample K)) (o (sample K)))) with (D K).
    split; [lra | split].
    + intros Hm Ho; apply (kept h L e gap h_positive Cv (steered i) (place i) o (command i) r k s d (drift i) (dip i)
        (cover i) Vo); try assumption; lra.
    + intros m Hm H0; pose proof (set_moves h gap Cv (place i) o k s) as S.
      assert (Q : m - sum (fun q => drift i * h + way h o q) K (k - K) <= D (K + (k - K))%nat).
      { apply (since h L e gap h_positive (steered i) o (command i) r K (k - K) m); [| exact Hm | exact H0].
        intros q Hq; destruct (H q ltac:(lia)) as [Cq Oq]; split; [exact Oq |]; apply off_is; rewrite next.
        apply (Cq h); lra. }
      rewrite sum_plus in Q; replace (K + (k - K))%nat with k in Q by lia.
      assert (0 <= sum (way h o) K (k - K)) by (apply sum_nonneg; intros; apply norm_nonneg).
      assert (0 <= INR (k - K) * (drift i * h)) by (apply Rmult_le_pos; [apply pos_INR | nra]).
      replace (INR (k - K) * h * drift i) with (INR (k - K) * (drift i * h)) by ring.
      unfold Rmin in Own; destruct (Rle_dec (D k) L); lra.
  - destruct H as [HV [Hm [H0 [[Cv [W H]] G]]]]; set (D := fun q => gap (sub (steered i (sample q)) (o (sample q)))).
    assert (One : forall q r0 f, (K <= q < K + N)%nat -> 0 <= r0 <= h -> m <= D q ->
      norm (sub (sub (steered i (sample q + r0)) (steered i (sample q))) (scale r0 (command i q))) <= drift i * r0 + f
        ->
      m - f <= gap (sub (steered i (sample q + r0)) (o (sample q + r0)))).
    { intros q r0 f Hq Hr Hq0 Off; destruct (H q Hq) as [_ O]; destruct (G q Hq) as [Rq Mq]; specialize (Mq r0 Hr).
      apply (held_off h L e gap h_positive (steered i) o (command i) r q r0 m (drift i + Vo) f); try assumption;
        [| lra].
      set (a := sub (sub _ _) (scale r0 (command i q))) in Off; set (b := sub (o (sample q + r0)) (o (sample q))) in *.
      pose proof (norm_difference a b); match goal with |- norm ?x <= _ =>
        replace x with (sub a b) by (unfold a, b, relative; apply vec_eq; vectors; ring) end; lra. }
    assert (At : m <= D k).
    { destruct Hk as [F Hk]; clear Hs; induction F as [| k F IH]; [exact H0 |]; specialize (IH ltac:(lia)).
      unfold D; rewrite next; rewrite <- (Rminus_0_r m); apply One; [lia | lra | exact IH |].
      destruct (H k ltac:(lia)) as [C _]; rewrite Rplus_0_r; apply (C h); lra. }
    destruct (H k Hk) as [C _]; destruct (C s Hs) as [T [_ Co]]; specialize (One k s (dip i) Hk Hs At T).
    pose proof (steady gap Cv (sub (steered i (sample k + s)) (o (sample k + s)))
      (sub (place i (sample k + s)) (o (sample k + s)))) as S.
    replace (sub (sub (steered i (sample k + s)) (o (sample k + s))) _)
      with (sub (steered i (sample k + s)) (place i (sample k + s))) in S by (apply vec_eq; vectors; ring).
    rewrite (norm_sym (steered i (sample k + s))) in S; lra.
Qed.

(** THEOREM: If all entries of a table were checked, all of them keep their promises.
    - The hypotheses of Mixed.entry_keeps. *)
Corollary run_all (table : list entry) : Forall checked table -> Forall promise table.
Proof. apply Forall_impl, entry_keeps. Qed.

(** * Help with the hypotheses *)

(** THEOREM (7)-(8), (11): Two bodies that both meet their shares of the law meet it as a pair.
    - The shares add up to 1.
    - Both use the same measured positions.
    Silent on: Anything about two robots with different measurements. *)
Lemma shares i j inside n e e' q q' w y m k : norm (sub w (apart i j (sample k))) <= err n -> nearest inside w y m ->
  q + q' = 1 -> e + e' = short n -> q * bound h (gain n) (dlaw n) (norm (sub w y)) - e <= dot m (command i k) ->
  q' * bound h (gain n) (dlaw n) (norm (sub w y)) - e' <= - dot m (command j k) -> pair_law i j inside n k.
Proof.
  intros E N Q S Mi Mj; left; exists w, y, m; rewrite <- S; split; [exact E | split; [exact N |]].
  exact (halves _ q q' e e' _ _ Q Mi Mj).
Qed.

(** THEOREM: Bodies with lag that are at rest at the first sample of their entry need no first distance of their own.
    - b is not negative and at most m. *)
Lemma from_rest i j mi mj inside m tau a K : 0 <= left m mi mj tau <= m -> velocity_of mi (sample K) = V 0 0 0 ->
  velocity_of mj (sample K) = V 0 0 0 -> clear inside m (sub (place (ahead i mi) (sample K)) (place (ahead j mj)
    (sample K))) ->
  clear inside (drawn (left m mi mj tau) a) (sub (place i (sample K)) (place j (sample K))).
Proof.
  unfold drawn; intros Hb Ei Ej H c Hc; specialize (H c Hc); simpl in H; rewrite Ei, Ej in H.
  match type of H with _ <= norm (sub ?x c) => match goal with |- _ <= norm (sub ?y c) =>
    replace x with y in H by (apply vec_eq; vectors; ring) end end.
  apply Rle_trans with (2 := H); set (b := left m mi mj tau) in *; apply Rle_trans with (sqrt (b * b)).
  - apply sqrt_le_1_alt; nra.
  - rewrite sqrt_square; lra.
Qed.

End Mixed.

(** ** The hypotheses can be met: for 7 s a robot at 10 m drives at 1 m/s towards a point at rest that it keeps 2 m
    from, and the same robot keeps 1 m from a person in that place who could walk at 0.5 m/s. *)
Definition driver := Body (fun t => V (10 - t) 0 0) (fun t => V (10 - t) 0 0) (fun _ => V (-1) 0 0) 0 0 0.
Definition drive := [
  Entry 0 7 (Together driver rest points (Numbers 1 2 0 0 0) 2);
  Entry 0 7 (Moving driver (fun _ => V 0 0 0) norm 0 (3/2) 1 (1/2) (fun _ => 0))].

Lemma drive_checked : Forall (checked 1) drive.
Proof.
  assert (C : forall k, conforms 1 driver k).
  { intros k; apply first_order; simpl; intros; try lra; vectors; f_equal; ring. }
  assert (S7 : forall k, (0 <= k < 0 + 7)%nat -> 0 <= Safety.sample 1 k <= 6).
  { intros k Hk; unfold Safety.sample; rewrite Rmult_1_r; split; [apply pos_INR |].
    replace 6 with (INR 6) by (simpl; ring); apply le_INR; lia. }
  assert (X : forall a, 0 <= a -> norm (V a 0 0) = a).
  { intros a Ha; unfold norm, dot; simpl; replace (a * a + 0 * 0 + 0 * 0) with (a * a) by ring; apply sqrt_square, Ha. }
  assert (A : forall x, 0 <= x -> along (V 1 0 0) (V x 0 0)).
  { intros x Hx; split; [apply X; lra | rewrite X by exact Hx; vectors; f_equal; ring]. }
  assert (E : forall x, sub (V x 0 0) (V 0 0 0) = V x 0 0) by (intros; vectors; f_equal; ring).
  apply Forall_cons; [| apply Forall_cons; [| apply Forall_nil]].
  - unfold checked, checked_together; simpl; split; [| split].
    + unfold budgeted, kept_by; simpl; replace (0 / 1) with 0 by field.
      replace ((2 + 0 + 0 + 0 + 0) * ((2 + 0 + 0 + 0 + 0) * 1) + 0 * (0 * 1)) with (2 * 2) by ring.
      rewrite sqrt_square by lra; repeat split; lra.
    + intros c ->; unfold kept_by, apart, Safety.sample; simpl; rewrite !E, X; lra.
    + intros k Hk; split; [apply C | split; [apply rest_conforms; lra |]]; specialize (S7 k Hk).
      left; exists (V (10 - Safety.sample 1 k) 0 0), (V 0 0 0), (V 1 0 0); unfold apart; simpl; rewrite !E.
      split; [apply near_itself; lra | split; [apply nearest_of_points, A; lra |]]; rewrite X by lra.
      unfold bound; destruct Rle_dec; vectors; lra.
  - unfold checked, checked_moving; simpl; split; [lra | split; [lra | split; [apply away_exists | split; [lra |]]]].
    intros k Hk; specialize (S7 k Hk); split; [apply C | left; split; [lra |]]; exists (V 1 0 0); rewrite E.
    split; [apply away_from_point, A; lra |]; rewrite X by lra.
    apply Rle_trans with (1 := Rmin_r _ _); vectors; lra.
Qed.

(** THEOREM: A robot that drives towards a point, and beside a person, meets the hypotheses: they can be met. *)
Theorem drive_kept : Forall (promise 1) drive.
Proof. apply run_all; [lra | exact drive_checked]. Qed.
