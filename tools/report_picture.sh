#!/bin/bash
# The picture of a report in the README, docs/report.png: the head of the demo's page, as a desk shows it.
#
#     tools/report_picture.sh [TRUEDEPTH]
#
# Needs Chromium. Builds the command in release unless a binary is named.
set -euo pipefail
cd "$(dirname "$0")/.."
truedepth=${1:-target/release/truedepth}
[ $# -gt 0 ] || cargo build --release --quiet
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
"$truedepth" demo -q -o "$folder/demo" >/dev/null || [ $? -eq 3 ]
# The paths of a temporary folder are nobody's.
sed -i "s#$folder/demo/#truedepth-demo/#g" "$folder/demo/report.html"
chromium --headless=new --no-sandbox --disable-gpu --hide-scrollbars --force-color-profile=srgb \
    --virtual-time-budget=4000 --window-size=1200,1010 --screenshot="$folder/shot.png" \
    "file://$folder/demo/report.html" >/dev/null 2>&1
mv "$folder/shot.png" docs/report.png
echo "docs/report.png: $(stat -c %s docs/report.png) bytes"
