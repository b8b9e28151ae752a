(** The event trigger: two triggers are never closer than the dwell, whatever the signal; no run is Zeno.

    ZENO-PROOF checks the constants, ZENO-TRACE the triggers of a run; that the program makes these transitions is for
    the tests. *)
Require Import Reals Lra Lia List.
Import ListNotations.
Local Open Scope R_scope.

Inductive mode := Supervising | Intervening | Refractory.
Record state := State { now : mode; triggers : nat; triggered_at : R }.

Section Automaton.

(** The threshold, m; below [release] a trigger can end; the least time from one trigger to the next, s. *)
Variables zeta release dwell : R.
Hypothesis dwell_nonneg : 0 <= dwell.

Definition rise (s : state) t := State Intervening (S (triggers s)) t.
Definition dwell_end (s : state) := match triggers s with O => 0 | _ => triggered_at s + dwell end.

(** [Trigger.start] and [Trigger.step] of the program, at time [t] with the decision variable [x]. *)
Definition start t x := if Rle_dec zeta x then rise (State Supervising 0 (-1)) t else State Supervising 0 (-1).
Definition step (s : state) t x :=
  match now s with
  | Supervising => if Rle_dec zeta x then rise s t else s
  | Intervening =>
      if Rle_dec x release then
        if Rlt_dec x zeta then
          if Rle_dec (dwell_end s) t then State Supervising (triggers s) (triggered_at s)
          else State Refractory (triggers s) (triggered_at s)
        else s
      else s
  | Refractory =>
      if Rle_dec (dwell_end s) t then
        if Rle_dec zeta x then rise s t else State Supervising (triggers s) (triggered_at s)
      else s
  end.

(** A run: any events, at times that do not run backwards, with any values of the decision variable. *)
Inductive run : state -> R -> list R -> Prop := (** state, time of the last event, times of triggers, latest first *)
| starts t x : run (start t x) t (match now (start t x) with Intervening => [t] | _ => [] end)
| goes_on s t l t' x : run s t l -> t <= t' ->
    run (step s t' x) t' (match now s, now (step s t' x) with
                          | Intervening, _ => l | _, Intervening => t' :: l | _, _ => l end).

(** Any two neighbours in the list, latest first, are at least the dwell apart. *)
Fixpoint spaced l := match l with
  | a :: (b :: _) as r => b + dwell <= a /\ spaced r
  | _ => True
  end.

(** What the automaton remembers is what an observer saw; while supervising the dwell is over. *)
Definition remembers s t l := triggers s = length l /\
  match l with
  | [] => now s = Supervising
  | a :: _ => triggered_at s = a /\ a <= t /\ (now s = Supervising -> a + dwell <= t)
  end.

Lemma invariant s t l : run s t l -> remembers s t l /\ spaced l.
Proof.
  intros R; induction R as [t x | s t l t' x R [[C M] Sp] T].
  - unfold start, remembers; destruct Rle_dec; simpl; repeat split; auto; lra || discriminate.
  - unfold remembers, step, dwell_end, rise in *; destruct s as [m n a]; simpl in *; subst n.
    destruct l as [| b l]; [subst m | destruct M as [-> [Ht Hs]]; destruct m]; simpl in *;
      repeat (destruct Rle_dec; simpl); repeat (destruct Rlt_dec; simpl); repeat (destruct Rle_dec; simpl);
      repeat split; auto; try discriminate; intros; try (specialize (Hs eq_refl)); try lra.
Qed.

(** THEOREM (20): Triggers i < j of a UGV are at least (j - i) dwell times apart, whatever the decision variable does.
    - Time does not run backwards.
    - The automaton makes the transitions of the theorem's model. *)
Theorem dwell_apart s t l : run s t l -> forall i j, (i < j < length l)%nat ->
  nth j l 0 + INR (j - i) * dwell <= nth i l 0.
Proof.
  intros R; apply invariant in R; destruct R as [_ Sp]; revert Sp.
  induction l as [| a l IH]; intros Sp i j H; simpl in H; [lia |].
  assert (Sl : spaced l) by (destruct l; [exact I | apply Sp]).
  destruct j as [| j]; [lia |]; destruct i as [| i]; [| apply (IH Sl i j); lia].
  destruct l as [| b l]; [simpl in H; lia |]; destruct Sp as [B _].
  destruct j as [| j]; [simpl; lra |].
  pose proof (IH Sl 0%nat (S j)) as N; simpl length in *; specialize (N ltac:(lia)).
  change (nth (S (S j)) (a :: b :: l) 0) with (nth (S j) (b :: l) 0).
  change (nth 0 (a :: b :: l) 0) with a; change (nth 0 (b :: l) 0) with b in N.
  rewrite Nat.sub_0_r in *; rewrite (S_INR (S j)); lra.
Qed.

(** [m] triggers take a time of [(m - 1) dwell] at least. *)
Theorem span s t l : run s t l -> forall i j T, (i <= j < length l)%nat ->
  nth i l 0 - nth j l 0 <= T -> INR (j - i) * dwell <= T.
Proof.
  intros R i j T H HT; destruct (Nat.eq_dec i j) as [-> | N].
  - rewrite Nat.sub_diag; simpl; lra.
  - pose proof (dwell_apart s t l R i j ltac:(lia)); lra.
Qed.

(** THEOREM (20): In a time T there are at most floor(T/dwell) + 1 triggers.
    - The dwell time is positive.
    - The hypotheses of Trigger.dwell_apart. *)
Corollary at_most s t l T : 0 < dwell -> run s t l -> forall i m, (i + m < length l)%nat ->
  nth i l 0 - nth (i + m) l 0 <= T -> (Z.of_nat (S m) <= Int_part (T / dwell) + 1)%Z.
Proof.
  intros P R i m H HT; pose proof (span s t l R i (i + m) T ltac:(lia) HT) as N.
  replace (i + m - i)%nat with m in N by lia.
  assert (Q : INR m <= T / dwell) by (apply Rmult_le_reg_r with dwell; [lra |]; field_simplify; lra).
  destruct (base_Int_part (T / dwell)) as [_ B]; rewrite INR_IZR_INZ in Q.
  assert (IZR (Z.of_nat m) < IZR (Int_part (T / dwell) + 1)) as L by (rewrite plus_IZR; lra).
  apply lt_IZR in L; lia.
Qed.

End Automaton.
