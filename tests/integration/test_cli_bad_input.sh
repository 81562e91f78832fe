#!/usr/bin/env bash
# Bad input: exit code 2, a message that says where, what, why and what to do, and nothing written.
# Usage: test_cli_bad_input.sh PROGRAM
set -u
program=$1
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work" || exit 1
failures=0

# refuse CODE PATTERN ARGUMENTS..: exits with CODE, stderr matches PATTERN, no file appears, stdout stays empty.
refuse() {
  local code=$1 pattern=$2 before after rc
  shift 2
  before=$(find . | sort)
  "$program" "$@" >"$work.out" 2>"$work.err"
  rc=$?
  after=$(find . | sort)
  if [ "$rc" != "$code" ]; then echo "FAIL hemowalk $*: exit $rc instead of $code"; cat "$work.err"; failures=$((failures + 1)); fi
  if ! grep -qE "$pattern" "$work.err"; then echo "FAIL hemowalk $*: no '$pattern' in:"; cat "$work.err"; failures=$((failures + 1)); fi
  if [ "$before" != "$after" ]; then echo "FAIL hemowalk $*: wrote something"; diff <(echo "$before") <(echo "$after"); failures=$((failures + 1)); fi
  if [ -s "$work.out" ]; then echo "FAIL hemowalk $*: something on stdout"; failures=$((failures + 1)); fi
  rm -f "$work.out" "$work.err"
}

campaign() { printf 'format: hemowalk.campaign/1\ntrajectories: [{synthetic: {platelets: 8, duration: 600 ms}}]\n%s\n' "$1"; }

refuse 2 'missing.yaml' run missing.yaml
refuse 2 'did you mean .calibrate' calibate
refuse 2 'not in this version' chart
refuse 2 'unknown command' nonsense
refuse 2 '(--frobnicate|not expected)' run --frobnicate
refuse 2 'needs a campaign' run
refuse 2 'needs one source' calibrate

campaign 'calibrat: {t0: 100 ms}' >unknown_key.yaml
refuse 2 'unknown_key.yaml:3:1: .*calibrat.*calibrate' run unknown_key.yaml
campaign 'calibrate: {t0: 100 um}' >wrong_unit.yaml
refuse 2 'wrong_unit.yaml:3:.*um' run wrong_unit.yaml
campaign 'calibrate: {t0: 100}' >no_unit.yaml
refuse 2 'no_unit.yaml:3:.*no unit' run no_unit.yaml
campaign $'replicas: 2\nreplicas: 3' >twice.yaml
refuse 2 'twice.yaml:4:1: .*replicas' run twice.yaml
campaign $'replicas: 0\non_failure: {action: perhaps}\nnonsense: 1' >several.yaml
refuse 2 'several.yaml:3:' run several.yaml
refuse 2 'several.yaml:4:' check several.yaml
refuse 2 'several.yaml:5:' plan several.yaml
printf 'format: hemowalk.campaign/1\ntrajectories: [{import: nowhere}]\n' >no_source.yaml
refuse 2 'nowhere' run no_source.yaml
printf 'format: hemowalk.campaign/1\ntrajectories: [{import: nowhere, optional: true}]\n' >nothing_left.yaml
refuse 2 'nothing to run' run nothing_left.yaml
printf 'format: hemowalk.campaign/1\nscene: nowhere.yaml\n' >no_scene.yaml
refuse 2 'nowhere.yaml' run no_scene.yaml
printf '{' >broken.yaml
refuse 2 'broken.yaml' run broken.yaml
: >empty.yaml
refuse 2 'empty.yaml' check empty.yaml

printf 'format: hemowalk.coarse/1\n' >no_law.yaml
refuse 2 'law' coarse no_law.yaml
printf 'format: hemowalk.coarse/1\nlaw: nowhere.yaml\n' >lost_law.yaml
refuse 2 'nowhere.yaml' coarse lost_law.yaml

mkdir empty_folder
refuse 2 'empty_folder' calibrate empty_folder
refuse 2 'empty_folder' calibrate --import empty_folder
mkdir empty_tracks
: >empty_tracks/body_1_ComPos.log
refuse 2 'body_1_ComPos.log' calibrate --import empty_tracks
echo 'not hdf5' >text.h5
refuse 2 'text.h5' calibrate text.h5
refuse 2 'no such folder' calibrate --import nowhere
refuse 2 'core' calibrate --import empty_tracks --core 40um:10um
refuse 2 'empty_folder' report empty_folder
refuse 2 'nowhere' status nowhere

[ "$failures" = 0 ] && echo "all refused as they should be"
exit "$failures"
