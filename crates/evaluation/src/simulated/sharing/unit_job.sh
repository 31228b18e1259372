#!/usr/bin/env bash
# One unit of an evaluation, as a task of a Slurm array. Written by `sdg evaluate --submit slurm`.
# Arguments: the list of units, and the number of units before the first one of this array.
set -u
folder=@FOLDER@
list=$1 before=$2
if [ ! -e "$folder/slurm/@MARKER@" ]; then
    echo "sdg: $folder: expected the folder that was submitted on @HOST@, found another one on $(uname -n): is it shared?" >&2
    exit 1
fi
unit=$(sed -n "$((SLURM_ARRAY_TASK_ID + before + 1))p" "$folder/slurm/@MARKER@-$list.units")
is_ended=
trap 'is_ended=yes' TERM
@COMMAND@ --out "$folder" --unit "$unit" && exit 0
status=$?
# A unit that failed for the first time is tried once more, on another node if there is one. A killed process leaves its running.json,
# which counts as a failure, as in --watch. A unit with a result (of fewer models) is tried again only after a recorded failure. The
# number of restarts is limited, because a program that cannot begin leaves no record.
# The task is requeued, so that arrays that depend on this one keep waiting. Slurm sends SIGTERM to requeued tasks, and also to tasks
# that are cancelled or reach their time limit; these are not requeued here. (Status 143: the signal came before sdg handled it.)
shopt -s nullglob
results=("$folder/units/$unit"/done-*.json)
tries=("$folder/units/$unit"/failed-*.json "$folder/units/$unit"/running.jso[n])
if [ -z "$is_ended" ] && [ "$status" -ne 143 ] && [ "${#tries[@]}" -le 1 ] &&
    { [ "${#results[@]}" -eq 0 ] || [ "${#tries[@]}" -eq 1 ]; } &&
    [ "${SLURM_RESTART_COUNT:-0}" -le "${#tries[@]}" ] && scontrol --version >/dev/null 2>&1; then
    trap '' TERM
    nodes=$(sinfo --noheader --Node --format %N --partition "${SLURM_JOB_PARTITION:-}" | sort -u | wc -l)
    if scontrol requeuehold "$SLURM_JOB_ID"; then
        if [ "$nodes" -gt 1 ]; then
            scontrol update "JobId=$SLURM_JOB_ID" "ExcNodeList=$SLURMD_NODENAME"
        fi
        scontrol release "$SLURM_JOB_ID"
    fi
fi
exit $status
