#!/usr/bin/env bash
# Bring the libraries of the page anew: the files as their authors published them on the npm registry, untouched.
# Change the version here, run this file, look at the page, and commit what came.
set -euo pipefail
uplot=1.6.32

here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
npm pack --silent "uplot@$uplot" >/dev/null
tar -xzf "uplot-$uplot.tgz"
cp package/dist/uPlot.iife.min.js package/dist/uPlot.min.css "$here"
cp package/LICENSE "$here/uPlot.LICENSE"
