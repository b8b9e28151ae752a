(** No UAV keeps a UGV from its own task for longer than [most (longest + h)] between two rests, whatever it sends.

    LIVE-WAIT checks the constants; that the program makes these transitions is for the tests. *)
Require Import Reals Lra Lia.
Local Open Scope R_scope.

(** Where a UGV stands: whether it executes an intervention, how many it has tried since it last rested, since when it
    has been in this state, and until when a try may last. *)
Record turn := Turn { executing : bool; tries : nat; since : R; until : R }.

Section Patience.

(** Most tries between two rests; how long a rest, a try, and a stay without progress may be; the sampling period, s. *)
Variables (most : nat) (rest longest behind h : R).
Hypotheses (longest_positive : 0 < longest) (h_positive : 0 < h).

(** The transitions of the program. *)
Definition accept w t e := Turn true (S (tries w)) t (if Rle_dec e (t + longest) then e else t + longest).
Definition stop w t := Turn false (tries w) t (until w).
Definition rested w := Turn (executing w) 0 (since w) (until w).

(** Any run: [t] is the time of the sample, [on] when the UGV was last on time, [c] how long it executed in tries that
    are over since the last rest. At a sample a try that is over or late stops; all else is left to the UAV and to
    chance. *)
Inductive run : turn -> R -> R -> R -> Prop :=
| begins t : run (Turn false 0 t 0) t t 0
| waits w t on c t' : run w t on c -> executing w = false -> t <= t' <= t + h -> run w t' on c
| accepts w t on c e : run w t on c -> executing w = false -> (tries w < most)%nat -> run (accept w t e) t t c
| goes_on w t on c t' on' : run w t on c -> executing w = true -> ~ until w <= t -> ~ t - on > behind ->
    t <= t' <= t + h -> on' = on \/ on' = t' -> run w t' on' c
| stops w t on c : run w t on c -> executing w = true -> run (stop w t) t on (c + (t - since w))
| rests w t on c : run w t on c -> executing w = false -> since w + rest <= t -> run (rested w) t on 0.

Definition invariant w t c := (tries w <= most)%nat /\ since w <= t /\
  if executing w
  then (1 <= tries w)%nat /\ c <= (INR (tries w) - 1) * (longest + h) /\ until w <= since w + longest
       /\ t <= since w + longest + h
  else c <= INR (tries w) * (longest + h).

Lemma holds w t on c : run w t on c -> invariant w t c.
Proof.
  intros R; unfold invariant in *; induction R as
    [t | w t on c t' R IH E T | w t on c e R IH E N | w t on c t' on' R IH E O L T P | w t on c R IH E
    | w t on c R IH E P];
    cbn -[INR] in *; try rewrite E in *; try change (INR 0) with 0; try (destruct IH as [M [Hs IH]]).
  - rewrite Rmult_0_l; repeat split; [lia | lra | lra].
  - repeat split; auto; lra.
  - rewrite S_INR in *; destruct Rle_dec; repeat split; try lia; lra.
  - destruct IH as [N [C [U B]]]; repeat split; auto; lra.
  - destruct IH as [N [C [U B]]]; repeat split; auto; lra.
  - rewrite Rmult_0_l; repeat split; [lia | lra | lra].
Qed.

(** ** Time executed since the last rest, the current try included *)
Theorem bounded w t on c : run w t on c ->
  c + (if executing w then t - since w else 0) <= INR most * (longest + h).
Proof.
  intros R; apply holds in R; destruct R as [M [_ I]]; apply le_INR in M.
  destruct (executing w); [destruct I as [_ [C [_ B]]] |]; nra.
Qed.

(** ** Without progress the UGV is given back at the sample after [on + behind] at the latest *)
Theorem given_back w t on c : run w t on c -> executing w = true -> 0 <= behind -> t <= on + behind + h.
Proof.
  intros R; induction R as [| | | w t on c t' on' R IH E O L T P | |]; simpl; intros X B;
    try discriminate; try congruence; [lra | destruct P; subst; lra].
Qed.

End Patience.
