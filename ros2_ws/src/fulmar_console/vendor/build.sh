#!/usr/bin/env bash
# Remake page/vendor.js and page/uplot.css from the locked packages, with their licences, and note the bundle's hash.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")"
page=../fulmar_console/page
npm ci --silent --no-audit --no-fund
npx esbuild entry.js --bundle --format=esm --minify --legal-comments=none --log-level=warning --outfile="$page/vendor.js"
cp node_modules/uplot/dist/uPlot.min.css "$page/uplot.css"
for package in three uplot; do
  printf '%s %s\n\n' "$package" "$(node -p "require('./node_modules/$package/package.json').version")"
  cat "node_modules/$package/LICENSE"
  printf '\n'
done > "$page/vendor_licences.txt"
(cd "$page" && sha256sum vendor.js uplot.css vendor_licences.txt) > vendor.sha256
rm -rf node_modules
