#!/bin/bash
# Kills `truedepth correct` at random moments: the output is absent or whole, the input unchanged.
#
#     bench/kill_correct.sh RECORDING [TIMES]        (TIMES is 100)
#
# Expects target/release/truedepth.
set -euo pipefail
recording=$(realpath "$1")
times=${2:-100}
truedepth=$(dirname "$(realpath "$0")")/../target/release/truedepth
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
correct() { "$truedepth" correct "$recording" -o "$work/out" --fault depth-scale=2% -q >/dev/null 2>&1; }
hashes() { (cd "$1" && find . -type f ! -name .lock -print0 | sort -z | xargs -0 sha256sum); }

before=$(hashes "$recording")
start=$(date +%s%N)
correct
whole_ms=$((($(date +%s%N) - start) / 1000000))
whole=$(hashes "$work/out")
rm -rf "$work/out"
absent=0
for ((i = 0; i < times; i++)); do
    correct &
    sleep "$(awk -v r=$RANDOM -v ms=$whole_ms 'BEGIN { printf "%.4f", 1.2 * ms * r / 32768 / 1000 }')"
    pkill -9 -P $! 2>/dev/null || true
    kill -9 $! 2>/dev/null || true
    wait $! 2>/dev/null || true
    if [ -e "$work/out" ]; then
        [ "$(hashes "$work/out")" = "$whole" ] || { echo "run $i left half a recording" >&2; exit 1; }
        rm -rf "$work/out"
    else
        absent=$((absent + 1))
    fi
done
[ "$(hashes "$recording")" = "$before" ] || { echo "the input has changed" >&2; exit 1; }
echo "$times kills within 1.2 x $whole_ms ms: $absent times no output, $((times - absent)) times a whole one; input unchanged"
