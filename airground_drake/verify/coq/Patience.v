(** What a UGV that has accepted an intervention does, and how long: LIVE-GATE, LIVE-WAIT. No UAV keeps it from its own
    task for longer than [most (longest + h)] between two rests, whatever it sends.

    The claims check the constants; that the program makes these transitions is for the tests. *)
Require Import Reals Lra Lia.
Local Open Scope R_scope.

(** Where a UGV stands: whether it executes an intervention, how many it has tried since it last rested, since when it
    has been in this state, and until when a try may last. *)
Record commitment := Commitment { executing : bool; tries : nat; since : R; until : R }.

Section Patience.

(** Most tries between two rests; how long a rest and a try may be; the sampling period, s. *)
Variables (most : nat) (rest longest h : R).
Hypotheses (longest_positive : 0 < longest) (h_positive : 0 < h).

(** The transitions of the program. *)
Definition accept w t e := Commitment true (S (tries w)) t (if Rle_dec e (t + longest) then e else t + longest).
Definition stop w t := Commitment false (tries w) t (until w).
Definition rested w := Commitment (executing w) 0 (since w) (until w).

(** A sample at which the UGV executes an intervention that the UAV has not withdrawn: it goes on unless the time is over,
    or an obstacle that it did not know makes the intervention not worth it any more. *)
Definition goes_on w t (news worth : bool) :=
  if Rle_dec (until w) t then stop w t else if andb news (negb worth) then stop w t else w.

(** Any run: [t] is the time of the sample, [c] how long the UGV executed in tries that are over since the last rest. At
    a sample a try that is over stops; all else is left to the UAV and to chance. *)
Inductive run : commitment -> R -> R -> Prop :=
| begins t : run (Commitment false 0 t 0) t 0
| waits w t c t' : run w t c -> executing w = false -> t <= t' <= t + h -> run w t' c
| accepts w t c e : run w t c -> executing w = false -> (tries w < most)%nat -> run (accept w t e) t c
| lasts w t c t' : run w t c -> executing w = true -> ~ until w <= t -> t <= t' <= t + h -> run w t' c
| stops w t c : run w t c -> executing w = true -> run (stop w t) t (c + (t - since w))
| rests w t c : run w t c -> executing w = false -> since w + rest <= t -> run (rested w) t 0.

Definition invariant w t c := (tries w <= most)%nat /\ since w <= t /\
  if executing w
  then (1 <= tries w)%nat /\ c <= (INR (tries w) - 1) * (longest + h) /\ until w <= since w + longest
       /\ t <= since w + longest + h
  else c <= INR (tries w) * (longest + h).

Lemma holds w t c : run w t c -> invariant w t c.
Proof.
  intros R; unfold invariant in *; induction R as
    [t | w t c t' R IH E T | w t c e R IH E N | w t c t' R IH E O T | w t c R IH E | w t c R IH E P];
    cbn -[INR] in *; try rewrite E in *; try change (INR 0) with 0; try (destruct IH as [M [Hs IH]]).
  - rewrite Rmult_0_l; repeat split; [lia | lra | lra].
  - repeat split; auto; lra.
  - rewrite S_INR in *; destruct Rle_dec; repeat split; try lia; lra.
  - destruct IH as [N [C [U B]]]; repeat split; auto; lra.
  - destruct IH as [N [C [U B]]]; repeat split; auto; lra.
  - rewrite Rmult_0_l; repeat split; [lia | lra | lra].
Qed.

(** ** Time executed since the last rest, the current try included *)
(** THEOREM (20): Between two rests no UAV keeps a UGV from its own task longer than tries (longest + h).
    - The gatekeeper is sampled every period h.
    - It makes the transitions of the theorem's model. *)
Theorem bounded w t c : run w t c ->
  c + (if executing w then t - since w else 0) <= INR most * (longest + h).
Proof.
  intros R; apply holds in R; destruct R as [M [_ I]]; apply le_INR in M.
  destruct (executing w); [destruct I as [_ [C [_ B]]] |]; nra.
Qed.

(** THEOREM (20): An accepted intervention is over after `longest` and a sampling period at the latest.
    - The hypotheses of Patience.bounded. *)
Theorem over_in_time w t c : run w t c -> executing w = true -> t <= since w + longest + h.
Proof. intros R E; apply holds in R; destruct R as [_ [_ I]]; rewrite E in I; tauto. Qed.

(** THEOREM (20): Unless a new obstacle is sensed, an accepted intervention is kept until its time is over, and not
    longer.
    - The UAV has not withdrawn it.
    - The gatekeeper makes the transitions of the theorem's model. *)
Theorem kept w t worth : executing w = true -> goes_on w t false worth = if Rle_dec (until w) t then stop w t else w.
Proof. reflexivity. Qed.

End Patience.
