#!/bin/sh
# The first steps of a new user with the installed program and photos: teaches model S the pendulum, and draws the grasp on its
# photo. Usage: first_grasp.sh SDG PHOTOS FOLDER
set -eu
"$1" teach --model S --demo "$2/pendulum/image.png:$2/pendulum/annotation.json" --out "$3/pendulum.sdg"
"$1" detect --grasp-model "$3/pendulum.sdg" --draw "$3/drawn" "$2/pendulum/image.png"
test -s "$3/drawn/image.png"
