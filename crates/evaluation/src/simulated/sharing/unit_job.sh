#!/usr/bin/env bash
# One unit of an evaluation, as a task of Slurm's array. What follows was written by `sdg evaluate --submit slurm`.
# Arguments: the list of units, and how many of them stand before the first of this array.
set -u
folder=@FOLDER@
list=$1 before=$2
if [ ! -e "$folder/slurm/@MARKER@" ]; then
    echo "sdg: $folder: expected the folder that was submitted on @HOST@, found another one on $(uname -n): is it shared?" >&2
    exit 1
fi
unit=$(sed -n "$((SLURM_ARRAY_TASK_ID + before + 1))p" "$folder/slurm/$list.units")
@COMMAND@ --out "$folder" --unit "$unit" && exit 0
status=$?
# A unit that failed for the first time is tried once more, on another node where there is one. The task goes back into the
# queue, so that the arrays that wait for this one go on waiting. SIGTERM is how Slurm ends what it puts back.
shopt -s nullglob
failures=("$folder/units/$unit"/failed-*.json)
if [ "${#failures[@]}" -eq 1 ] && scontrol --version >/dev/null 2>&1; then
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
