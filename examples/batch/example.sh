#!/bin/sh
# Makes 8 synthetic people, damages a scan of one, dresses them with Snakemake, kills one job while it runs, and compares the
# summary with that of `replay --subjects`.
#
#   example.sh PROGRAM FOLDER [ARGUMENTS OF SNAKEMAKE]
set -eu
batch=$(cd "$(dirname "$0")" && pwd)
overcoat=$(realpath "$1")
mkdir -p "$2"
cd "$2"
shift 2

echo "subject, body, tshirt" > people.csv
for seed in 101 102 103 104 105 106 107 108; do
    test -d "scans/p$seed" || "$overcoat" -q studio make --seed $seed --garments tshirt --views 16 --no-frames --faces 20000 --out "scans/p$seed"
    echo "p$seed, scans/p$seed/0-body.ply, scans/p$seed/1-tshirt.ply" >> people.csv
done
head -c 200000 scans/p105/1-tshirt.ply > scans/damaged.ply
sed -i 's|scans/p105/1-tshirt.ply|scans/damaged.ply|' people.csv

rm -rf recipe people replayed
"$overcoat" -q new recipe
"$overcoat" -C recipe -q scan body scans/p101/0-body.ply
"$overcoat" -C recipe -q scan tshirt scans/p101/1-tshirt.ply --template tshirt

snakemake -s "$batch/Snakefile" --config subjects=people.csv recipe=recipe into=people overcoat="$overcoat" --keep-going "$@" > snakemake.log 2>&1 &
running=$!
killed=
while test -z "$killed" && kill -0 $running 2> /dev/null; do
    sleep 0.2
    killed=$(pgrep -f "^$overcoat replay .* --into $PWD/people/p103 " | head -1) || true
done
sleep 0.5
kill -9 "$killed" && echo "killed the job of p103"
wait $running && { echo "the damaged scan was not noticed"; exit 1; }
grep -A1 "people dressed" snakemake.log

"$overcoat" -q replay recipe --subjects people.csv --into replayed --jobs 2 2> /dev/null > /dev/null || true
cmp people/summary.csv replayed/summary.csv
for seed in 101 103 108; do
    diff -r "people/p$seed/artefacts" "replayed/p$seed/artefacts"
done
echo "the same summary and results as replay --subjects"
