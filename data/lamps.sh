#!/usr/bin/env bash
# Makes the lamps that data/scenes/ are lit by:
#   data/lamps.sh LUXFIELD [FOLDER]     LUXFIELD is the program, FOLDER defaults to out/lamps
# bike: 9 x 7 images of 300 x 300, car1: 5 x 5 of 256 x 256, car2: 11 x 9 of 256 x 256. Each is the simulated
# lab's true light field with C >= 0. A lamp that is newer than its lab and plan is kept.
set -euo pipefail
luxfield=$1
data=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
folder=${2:-$(dirname "$data")/out/lamps}
mkdir -p "$folder"

make_lamp() {  # NAME LAB PLAN
  local field="$folder/$1.lf.exr"
  if [ "$field" -nt "$2" ] && [ "$field" -nt "$3" ]; then
    echo "lamps: $1 is up to date"
    return
  fi
  "$luxfield" simulate "$2" --plan "$3" --non-negative -o "$field"
}

make_lamp bike "$data/labs/bike.toml" "$data/plans/bike.toml"
make_lamp car1 "$data/labs/car1.toml" "$data/plans/car1.toml"
make_lamp car2 "$data/labs/headlight.toml" "$data/plans/car2.toml"
