#!/usr/bin/env bash
# How much faster two ranks are than one: the curb campaign by 1 and by 2 ranks of one thread each, alternating.
# usage: bench/ranks.sh [PROGRAM [PARTICLES [ROUNDS]]]     (default: build/release/graze 200 5)
# Prints the particle-steps per second of each run as the program reports them, and the ratio of the best of each.
set -euo pipefail
program=$(realpath "${1:-build/release/graze}")
particles=${2:-200}
rounds=${3:-5}
scenario=$(realpath "$(dirname "$0")/../data/scenarios/quadruped_curb.yaml")
export OMPI_MCA_plm_rsh_agent=sh OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"

rate() {  # RANKS
  mpirun -np "$1" "$program" run "$scenario" -n "$particles" --threads 1 --force -o campaign.graze 2>&1 >/dev/null |
    grep -o '[0-9.e+]* particle-steps/s' | tail -n 1 | cut -d' ' -f1
}

for _ in $(seq "$rounds"); do
  for ranks in 1 2; do echo "$ranks $(rate "$ranks")"; done
done | tee rates
awk '$2 > best[$1] { best[$1] = $2 } END { printf "best: 1 rank %g, 2 ranks %g particle-steps/s, ratio %.2f\n", best[1], best[2], best[2] / best[1] }' rates
