#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# ./kerf itself, with stand-ins for the programs: exit codes, what is kept, and that no process and
# no temporary file survives any way out. Builds nothing; takes a minute. tests/script has what is
# typed and the help, tests/programs/demo_test.py the parts of a demo alone.
set -euo pipefail
root=$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")/..
lab=$(mktemp -d)
trap 'rm -rf "$lab"' EXIT
mkdir "$lab/bin" "$lab/tmp"
export KERF_BIN=$lab/bin TMPDIR=$lab/tmp LAB=$lab
unset DISPLAY WAYLAND_DISPLAY

# The stand-in: notes its process and its arguments, does what a demo needs of it, and ends with
# the exit code FAIL_<name> where that is set, or by the signal CRASH_<name>. The file `segment` lives as long as the controller.
cat >"$lab/stand-in" <<'PROGRAM'
#!/usr/bin/env bash
name=${0##*/kerf-} words=$*
echo $$ >>"$LAB/pids"
echo "$name $*" >>"$LAB/calls"
fail=FAIL_$name code=0
if [[ -n ${!fail:-} ]]; then code=${!fail}; fi
crash=CRASH_$name
if [[ $* == *--describe* ]]; then
  if [[ -n ${CRASH_describe:-} ]]; then kill "-$CRASH_describe" $$; fi
elif [[ -n ${!crash:-} ]]; then
  (sleep 0.3 && kill "-${!crash}" $$ && if [[ $name == controller ]]; then rm "$LAB/segment"; fi) &
fi
if ((code == 2)); then
  echo "kerf-$name: place: value; way out ($*)" >&2
  exit 2
fi
declare -A option=()
while (($#)); do
  if [[ $1 == --* && ${2:---} != --* ]]; then
    option[$1]=$2
    shift
  fi
  shift
done
out=${option[--out]:-$LAB}
case $name in
  controller)
    trap 'stop=1' TERM
    touch "$LAB/segment"
    printf 'hand_unit_mm=2\nhand_script=%s/hand.toml\nrate_hz=%s\n' "$LAB" "${RATE_HZ:-500}" \
      >"${option[--emulator-args]}.part"
    mv "${option[--emulator-args]}.part" "${option[--emulator-args]}"  # at once, as the controller does
    until grep -q '^emulator.*--hand' "$LAB/calls" || ((stop)); do sleep 0.02; done
    for ((i = 0; i < 10 * option[--seconds] && !stop; ++i)); do sleep 0.03; done
    # As on a disk that the recording has filled.
    if ((stop)) && [[ -n ${FULL:-} && -e ${option[--report]%/*}/log/begun ]]; then
      echo 'kerf-controller: no room for the report' >&2
    fi
    echo '{}' >"${option[--report]}"
    touch "${option[--final]}"
    rm "$LAB/segment"
    echo 'the summary'
    ;;
  emulator)
    if [[ -n ${option[--mount]:-} ]]; then
      trap 'exit 0' TERM
      touch "${option[--mount]}/fw1"
      while [[ -e $LAB/segment ]]; do sleep 0.05; done
      exit 0
    fi
    exec perl -MIO::Socket::UNIX -e '
      $socket = IO::Socket::UNIX->new(Local => shift, Listen => 1) or die;
      select undef, undef, undef, 0.05 while -e "$ENV{LAB}/segment"' "${option[--socket]}"
    ;;
  visualizer | recorder)
    trap 'exit 0' TERM
    if [[ $name == visualizer ]]; then
      sleep "${SLOW:-0}"
      [[ -e $LAB/segment ]] || { echo 'kerf-visualizer: no controller' >&2; exit 2; }
      touch "${option[--attached]}"
      echo 'shown' >>"$LAB/calls"
      if [[ -n ${LOST:-} && -n ${option[--hand-socket]:-} ]]; then
        until grep -q '^emulator.*--hand' "$LAB/calls"; do sleep 0.02; done
        echo 'kerf-visualizer: window: the X server is gone; way out' >&2
        exit 2
      fi
      if [[ -n ${CHOICE:-} && -n ${option[--choice]:-} && ! -e $LAB/chosen ]]; then
        touch "$LAB/chosen"
        sleep 0.3
        echo "$CHOICE" >"${option[--choice]}"
        exit 0
      fi
    fi
    if [[ $name == recorder ]]; then mkdir -p "$out" && touch "$out/begun"; fi
    if [[ $name == recorder && -n ${STUCK:-} ]]; then
      trap '' TERM
      exec sleep 60
    fi
    if [[ $name == recorder && -n ${TAKEN:-} ]]; then
      until grep -q '^emulator.*--hand' "$LAB/calls"; do sleep 0.02; done
      mv "$LAB/gone" "$LAB/taken"
      echo 'kerf-recorder: place: value; way out' >&2
      exit 2
    fi
    while [[ -e $LAB/segment ]]; do sleep 0.05; done
    if [[ $name == recorder ]]; then rm -f "$out/begun" && mkdir -p "$out" && touch "$out/ticks.npy"; fi
    if [[ $words == *--headless* ]]; then touch "$out/frame-0001.png"; fi  # a window writes what its keys ask for
    ;;
  record)
    touch "$out"
    if [[ -n ${MEANWHILE:-} ]]; then mkdir -p "${MEANWHILE%/*}" && echo mine >"$MEANWHILE"; fi
    ;;
  studies)
    trap 'stop=1' TERM
    echo 'emulator --hand of studies' >>"$LAB/calls"
    until [[ -z ${LONG:-} ]] || ((stop)); do sleep 0.02; done
    if ((!code)); then mkdir -p "$out" && touch "$out/report.json" "$out/frame-0001.png"; fi
    ;;
  bridge)
    trap 'exit "$code"' TERM
    echo 'http://127.0.0.1:7400/?token=abc'
    sleep 0.2
    echo 'http://127.0.0.1:7400/?token=def'
    while :; do sleep 0.05; done
    ;;
esac
if [[ -n ${!crash:-} ]]; then wait; fi
exit "$code"
PROGRAM
chmod +x "$lab/stand-in"
for name in controller emulator visualizer recorder record bridge studies; do
  ln -s ../stand-in "$lab/bin/kerf-$name"
done

# Root without its power over files: what a user has no rights to, it has none to either.
user=()
if ((EUID == 0)); then user=(setpriv '--bounding-set=-dac_override,-dac_read_search' --inh-caps=-all); fi

checks=0 failures=0 as=()
# expect TEXT CONDITION...: one check; CONDITION is a command.
expect() {
  checks=$((checks + 1))
  if ! "${@:2}"; then
    failures=$((failures + 1))
    echo "check-kerf: failed: $1 (${*:2})"
    sed 's/^/  | /' "$lab/said"
  fi
}

# kerf_gives CODE ARG...: ./kerf ARG... exits with CODE; what it said lies in $lab/said.
kerf_gives() {
  local code=0
  rm -f "$lab/pids" "$lab/calls" "$lab/segment"
  "${as[@]}" "$root/kerf" "${@:2}" >"$lab/said" 2>&1 || code=$?
  [[ $code == "$1" ]]
}
says() { grep -q -- "$1" "$lab/said"; }
one_line() { [[ $(<"$lab/said") == "$1" ]]; }
one_line_like() { [[ $(<"$lab/said") == $1 ]]; }
called() { grep -q -- "$1" "$lab/calls"; }
kept() { [[ $(cd "$lab" && find out -mindepth 1 | LC_ALL=C sort | tr '\n' ' ') == "$1" ]]; }
nothing_survives() {
  local pid
  [[ -z $(ls -A "$lab/tmp") ]] || return 1
  while read -r pid; do
    if grep -qs '^State:[[:space:]]*[^[:space:]ZX]' "/proc/$pid/status"; then return 1; fi
  done <"$lab/pids"
}
# interrupted SIGNAL CODE OPTION...: a demo that is hit in its middle ends with CODE, long before its time.
interrupted() {
  rm -f "$lab/pids" "$lab/calls" "$lab/segment"
  # A background process ignores SIGINT and SIGQUIT, and so does all that runs below one.
  env --default-signal=INT,QUIT "$root/kerf" demo --seconds 60 --out "$lab/out" "${@:3}" >"$lab/said" 2>&1 &
  local demo=$! code=0 began
  until [[ -e $lab/calls ]] && called '^emulator'; do sleep 0.05; done
  sleep 0.2
  began=$SECONDS
  kill "-$1" "$demo"
  wait "$demo" 2>/dev/null || code=$?
  sleep 0.3
  ((code == $2 && SECONDS - began <= 15))  # of the 60 that the demo would last
}
as_user() {
  local as=("${user[@]}")
  "$@"
}
# typed KEY CODE: a demo in a terminal of its own, where KEY is typed in its middle, ends with CODE. Or the
# terminal is closed: KEY is empty.
typed() {
  local code=0
  rm -f "$lab/pids" "$lab/calls" "$lab/segment"
  env --default-signal=HUP,INT,QUIT python3 - "$1" "$lab/calls" "$root/kerf" demo --seconds 60 --out "$lab/out" \
    >"$lab/said" <<'TERMINAL' || code=$?
import os, pty, sys, time
key, calls, *command = sys.argv[1:]
process, terminal = pty.fork()
if not process:
    os.execv(command[0], command)
while not os.path.exists(calls) or ' --hand ' not in open(calls).read():
    time.sleep(0.05)
time.sleep(0.5)
if key:
    os.write(terminal, key.encode())
    try:
        while said := os.read(terminal, 4096):
            os.write(1, said)
    except OSError:
        pass
else:
    os.close(terminal)
sys.exit(os.waitstatus_to_exitcode(os.waitpid(process, 0)[1]))
TERMINAL
  sleep 0.3
  [[ $code == "$2" ]]
}
with() {
  local -x "$1"
  "${@:2}"
}
all='out/.kerf-demo out/.kerf-demo/files out/.kerf-demo/lock out/final.nrrd out/forces.svg out/frame-0001.png out/log out/log/ticks.npy out/report.json '

cd "$lab"  # where a demo without a display keeps its pictures
expect 'a hand that is not there is an error' kerf_gives 2 demo --seconds 1
expect 'which says whose it is' says 'phantom.toml: its hand.script, .*/hand.toml, is no file; copy the script there, or give --hand FILE$'
expect 'and leaves nothing' nothing_survives
touch hand.toml
expect 'a demo runs' kerf_gives 0 demo --seconds 1
expect 'without a display it says where its pictures are' says '^kept in kerf-demo: '
expect 'and there they are' test -e kerf-demo/frame-0001.png
expect 'and once more, in place of the first' kerf_gives 0 demo --seconds 1
expect 'asked for no window, it keeps the same' kerf_gives 0 demo --seconds 1 --headless
expect 'and says so' says '^kept in kerf-demo: '
expect 'but a sheet alone, if that is asked for' kerf_gives 0 demo --seconds 1 --sheet s.png
expect 'and says so, too' says '^kept s.png alone: --out DIR keeps'
mv kerf-demo/frame-0001.png kerf-demo/mine.png
expect 'a folder of somebody else is not touched' kerf_gives 2 demo --seconds 1
rm -r kerf-demo
expect 'a demo in an empty folder' kerf_gives 0 demo --seconds 1
expect 'the hand is the one that the scene names' called '^emulator.*--hand [^ ]*/hand.toml --unit-mm 2'
expect 'the frames are spread over the run' called '^visualizer.*--every-ticks 41 '
expect 'a demo leaves nothing behind' nothing_survives
expect 'a run may be shorter than the visualizer takes to start' \
  with SLOW=1 kerf_gives 0 demo --seconds 1
expect 'whose hand waits for it' test "$(grep -m 1 -oE '^(shown|emulator .*--hand)' "$lab/calls")" == shown
expect 'a longer run begins' with SLOW=0.5 kerf_gives 0 demo --seconds 4
expect 'before its pictures do' test "$(grep -m 1 -oE '^(shown|emulator .*--hand)' "$lab/calls" | cut -d ' ' -f 1)" == emulator
expect 'a film has its start' with SLOW=0.5 kerf_gives 0 demo --seconds 4 --record v.y4m
expect 'and its hand waits' test "$(grep -m 1 -oE '^(shown|emulator .*--hand)' "$lab/calls")" == shown
expect 'a disk that fills up ends it' \
  with FULL=1 with FAIL_visualizer=2 kerf_gives 2 demo --seconds 60 --headless --out "$lab/out"
expect 'in one line' test "$(wc -l <"$lab/said")" == 1
expect 'a program that does not end is ended' with STUCK=1 kerf_gives 1 demo --seconds 1 --headless
expect 'in one line beside the summary' test "$(grep -vcE '^(the summary$|kept in )' "$lab/said")" == 1
expect 'which says so' says '^kerf: demo: recorder: still busy after 10 s; ended by force$'
expect 'a folder that is taken away ends it' \
  with TAKEN=1 kerf_gives 2 demo --seconds 60 --headless --out "$lab/gone"
expect 'in one line, too' one_line 'kerf-recorder: place: value; way out'
expect 'and none is made in its place' test ! -e "$lab/gone"
rm -rf "$lab/taken"
expect 'the way of drawing reaches the visualizer' kerf_gives 0 demo --seconds 1 --renderer cast
expect 'as it was said' called '^visualizer.*--renderer cast '
expect 'an arm on FireWire' kerf_gives 0 demo --seconds 1 --port fw
expect 'is where the emulator mounts it' called '^emulator.*--front fuse --mount .*/bus '
expect 'and the controller looks' called '^controller.*--port fw:.*/bus/fw1 '
expect 'and leaves nothing behind' nothing_survives
expect 'two eyes, opacities and a video' \
  kerf_gives 0 demo --seconds 1 --stereo --transfer t.toml --record v.y4m
expect 'reach the visualizer' called '^visualizer.*--stereo --transfer t.toml --record v.y4m '
expect 'with a display they' with DISPLAY=:99 kerf_gives 0 demo --seconds 1 --stereo \
  --record v.y4m --out "$lab/out"
expect 'reach the window, which keeps its files with the others' \
  called '^visualizer --name [^ ]* --stereo --record v.y4m --out .*/out '
expect 'and there is one video' test "$(grep -c -- --record "$lab/calls")" == 1
expect 'the pointer is the hand' with DISPLAY=:99 kerf_gives 0 demo --seconds 1 --hand mouse
expect 'in the window' called '^visualizer.*--hand-socket [^ ]*/hand '
expect 'of the emulator, which has no script' called '^emulator.*--hand-socket [^ ]*/hand --unit-mm'
expect 'and leaves nothing behind' nothing_survives
expect 'a window that ends ends it' \
  with DISPLAY=:99 with FAIL_visualizer=2 kerf_gives 2 demo --seconds 60 --hand mouse
expect 'in its words' says 'kerf-visualizer: place: value; way out'
expect 'and leaves nothing behind' nothing_survives
expect 'a screen that goes away ends it too' \
  with DISPLAY=:99 with LOST=1 kerf_gives 1 demo --seconds 60 --hand mouse --out "$lab/out"
expect 'in words' says 'the X server is gone; way out'
expect 'with what was done until then' test -e "$lab/out/report.json"
expect 'and leaves nothing behind' nothing_survives
touch other.toml
expect 'a scene that the window chose is the next demo' \
  with DISPLAY=:99 with CHOICE=$lab/other.toml kerf_gives 0 demo --seconds 5 --stereo --scene "$root/scenes/wall.toml"
expect 'with the first one before it' called '^controller.*--scene .*wall.toml'
expect 'in its place' called "^controller.*--scene $lab/other.toml"
expect 'and all else as it was' test "$(grep -c '^visualizer.*--stereo' "$lab/calls")" = 2
expect 'which is told' says "^kerf: demo: $lab/other.toml\$"
rm "$lab/chosen"
expect 'a volume likewise' \
  with DISPLAY=:99 with CHOICE=/else/ct.nrrd kerf_gives 0 demo --seconds 5 --hand mouse --out "$lab/out"
expect 'without the scene of the first' called '^controller.*--volume /else/ct.nrrd'
expect 'and nothing is left behind' nothing_survives
expect 'a picture is served' kerf_gives 0 demo --seconds 1 --serve --headless
expect 'its address is told' says 'http://127.0.0.1:7400/?token=abc'
expect 'and that for the next browser' says 'http://127.0.0.1:7400/?token=def'
expect 'on this machine' called '^bridge serve --name demo-[0-9]* --listen 127.0.0.1:0$'
expect 'the bridge ends with the demo' nothing_survives
expect 'elsewhere' kerf_gives 0 demo --seconds 1 --serve --listen 0.0.0.0:7400
expect 'where it is asked to' called '^bridge .*--listen 0.0.0.0:7400$'
expect 'a bridge that cannot listen ends the demo' with FAIL_bridge=2 kerf_gives 2 demo --serve
expect 'it has not begun' eval '! called ^controller'
expect 'in its words' says 'kerf-bridge: place: value; way out'
expect 'a bridge that falls does not stop the demo' with CRASH_bridge=SEGV kerf_gives 1 demo --seconds 2 --serve
expect 'and is told' says 'bridge: ended by signal 11'
expect 'all of it is cleared up' nothing_survives
expect 'two machines, anywhere among the options' kerf_gives 0 demo --seconds 2 --set a.b=1 --loss 1 --two-machines \
  --renderer blend --rate 500 --hand h.toml --device falcon --out "$lab/out"
expect 'with the options of a demo' called '^studies two-machines --scene .*/scenes/phantom.toml --device falcon --hand h.toml --seconds 2 --loss 1 --headless --controller-word=--set --controller-word=a.b=1 --controller-word=--rate --controller-word=500 --visualizer-word=--renderer --visualizer-word=blend --out '
expect 'and the same results' says '^kept in .*report.json, 1 frame'
expect 'nothing survives them' nothing_survives
expect 'a machine that forbids them says so by its exit code' with FAIL_studies=77 kerf_gives 77 demo --two-machines
for wrong in --virtual --serve '--port fw' '--hand mouse' '--loss 51' '--loss nan' '--delay-ms 2001'; do
  # shellcheck disable=SC2086  # two words
  expect "two machines exclude $wrong" with DISPLAY=:99 kerf_gives 2 demo --two-machines $wrong
  expect 'in one line' one_line_like "kerf: demo: ${wrong}*"
done
expect 'a link needs two ends' kerf_gives 2 demo --mbit 4
expect 'in its words' says 'give --two-machines too'
expect 'a fast servo' with RATE_HZ=8000 kerf_gives 0 demo --seconds 1
expect 'is answered in every cycle of the bus' called '^emulator.*--packet-cycles 1 '
expect 'its rate' kerf_gives 0 demo --seconds 1 --rate 4000
expect 'is that of the controller' called '^controller.*--rate 4000 '
expect 'a slow one' kerf_gives 0 demo --seconds 1
expect 'leaves the emulator its own pace' test "$(grep -c -- --packet-cycles "$lab/calls")" == 0
expect 'a demo keeps its results' kerf_gives 0 demo --seconds 1 --out "$lab/out" --virtual
expect 'all of them' kept "$all"
expect 'in a folder with the rights that the umask leaves' \
  test "$(stat -c %a "$lab/out")" == "$(printf %o $((0777 & ~$(umask) | 0700)))"
expect 'lock-step reaches the controller' called '^controller.*--virtual'
expect 'lock-step reaches the emulator' called '^emulator.*--lockstep'
expect 'and is led from picture to picture' called '^controller.*--virtual --until .*/lead '
expect 'by the visualizer' called '^visualizer.*--lead .*/lead '
expect 'the second demo replaces the first' kerf_gives 0 demo --seconds 1 --out "$lab/out"
expect 'and leaves nothing else' kept "$all"
mkdir "$lab/bare" && echo 'import sys; sys.modules["matplotlib"] = None' >"$lab/bare/sitecustomize.py"
expect 'without matplotlib a demo runs' with PYTHONPATH="$lab/bare" kerf_gives 0 demo --seconds 1 --out "$lab/out"
expect 'and says that it draws no plot' says '^kerf: demo: forces.svg is not drawn: no matplotlib; '
expect 'which is all that is missing' kept "${all/out\/forces.svg /}"

expect 'a failed check is told' \
  with FAIL_controller=1 kerf_gives 1 demo --seconds 1 --out "$lab/out"
expect 'and its results are kept' kept "$all"
expect 'a crash is a failed check' with FAIL_controller=139 kerf_gives 1 demo --seconds 1
for name in controller emulator recorder visualizer record; do
  expect "a crash of the $name" with "CRASH_$name=SEGV" kerf_gives 1 demo --seconds 2 --out "$lab/crash"
  expect 'is told in one line of ours' says "^kerf: demo: $name: ended by signal 11\$"
  expect 'and in no other' test "$(grep -c '^kerf: \|line [0-9]*:' "$lab/said")" == 1
done
expect 'a crash before the demo begins' with CRASH_describe=SEGV kerf_gives 1 demo
expect 'is told too' test "$(cat "$lab/said")" == 'kerf: demo: emulator: ended by signal 11'
rm -rf "$lab/crash"
expect 'a failing picture is told' with FAIL_visualizer=2 kerf_gives 2 demo --seconds 1
expect 'with its reason' says '^kerf-visualizer: place: value; way out'
expect 'a failing picture for a folder of an odd name' with FAIL_visualizer=2 kerf_gives 2 demo --seconds 1 --out 'a|b&c\1[b]*'
expect 'is told with its reason and the folder as it was named' \
  one_line_like 'kerf-visualizer: place: value; way out (* --out a|b&c\\1\[b\]\* *)'
expect 'a failing log is told' with FAIL_recorder=1 kerf_gives 1 demo --seconds 1
expect 'a bad scene is bad input' with FAIL_controller=2 kerf_gives 2 demo --out "$lab/new"
expect 'which makes no folder' test ! -e "$lab/new"
expect 'a bad hand is bad input' with FAIL_emulator=2 kerf_gives 2 demo --out "$lab/new"
expect 'with its reason' says '^kerf-emulator: place: value; way out'
expect 'which makes no folder either' test ! -e "$lab/new"
expect 'a failure leaves nothing behind' nothing_survives

expect 'a stopped demo ends with 130' interrupted INT 130
expect 'its results so far are kept' kept "$all"
expect 'nothing survives a stop' nothing_survives
rm -rf out
expect 'so does one whose terminal had a Ctrl-C' typed $'\x03' 130
expect 'its summary is told' says 'the summary'
expect 'its results so far are kept' kept "$all"
expect 'which is told' says "^kept in $lab/out: "
expect 'nothing survives it' nothing_survives
expect 'a Ctrl-\' typed $'\x1c' 143
expect 'ends alike' says "^kept in $lab/out: "
rm -rf out
expect 'a terminal that is gone too' typed '' 143
expect 'with all results' kept "$all"
expect 'nothing survives it' nothing_survives
rm -rf out
expect 'nobody has to read what it says' eval '"$root/kerf" demo --seconds 1 --out out | true'
expect 'to keep its results' kept "$all"
expect 'so does one on two machines' with LONG=1 interrupted INT 130 --two-machines
expect 'it keeps its results, too' says "^kept in $lab/out: forces.svg report.json, 1 frame"
expect 'nothing survives it' nothing_survives
rm -rf out
expect 'a terminated demo ends with 143' interrupted TERM 143
expect 'nothing survives a termination' nothing_survives
for signal in PWR QUIT RTMIN+3; do
  expect "a demo that $signal meets ends alike" interrupted "$signal" 143
  expect "nothing survives it" nothing_survives
done
expect 'no process survives a kill' interrupted KILL 137
rm -rf "$lab"/tmp/*
expect 'none at all' nothing_survives
expect 'the next demo clears up after it' kerf_gives 0 demo --seconds 1 --out "$lab/out"
expect 'completely' kept "$all"

touch "$lab/out/mine.txt"
expect 'a folder with other files is refused' kerf_gives 2 demo --out "$lab/out"
expect 'by the name of the first' says 'holds mine.txt'

# Rights.
rm -rf out
mkdir names
for rights in 0 300 500 600; do
  mkdir -m "$rights" "names/$rights"
  expect "a folder of mode $rights" as_user kerf_gives 2 demo --out "names/$rights"
  expect 'is refused in one line' says "^kerf: demo: --out names/$rights: cannot be \(read\|written\); name another folder\$"
  expect 'before anything runs' test ! -e calls
done
expect 'below one that cannot be entered' as_user kerf_gives 2 demo --out names/0/x
expect 'likewise' one_line 'kerf: demo: --out names/0/x: cannot be created; name another folder'
mkdir -p names/rest/.kerf-demo/new/rest && chmod 500 names/rest/.kerf-demo/new
expect 'where what a killed demo left cannot be cleared up' as_user kerf_gives 2 demo --out names/rest
expect 'likewise' one_line 'kerf: demo: --out names/rest: cannot be written; name another folder'
chmod -R u+rwx names

# Two at once: what the first one makes is its own.
rm -f pids calls segment
"$root/kerf" demo --seconds 60 --out out >first 2>&1 &
first=$!
until [[ -e calls ]] && called '^emulator'; do sleep 0.05; done
code=0
"$root/kerf" demo --seconds 1 --out out/ >said 2>&1 || code=$?
expect 'a folder where another demo is at work is refused' test "$code" == 2
expect 'in one line' one_line 'kerf: demo: --out out/: another demo is at work there; wait for its end or name another folder'
expect 'which leaves that alone' test -d out/.kerf-demo/new
kill -TERM "$first" || true
code=0
wait "$first" || code=$?
cp first said
expect 'so that it ends well' test "$code" == 143
expect 'with all results' kept "$all"
expect 'and then there is room' kerf_gives 0 demo --seconds 1 --out out
expect 'a wrong option is one line' kerf_gives 2 demo --size $'1\n2'
expect 'of it' one_line 'kerf: demo: --size 1?2: not WIDTHxHEIGHT in pixels, 1 to 8192 each; take 640x480'
expect 'and comes before programs that are not there' with KERF_BIN=/nowhere kerf_gives 2 demo --fast
expect 'in its words' one_line 'kerf: demo: --fast: unknown; see ./kerf demo --help'
expect 'help is that of the command' kerf_gives 0 demo --seconds 1 --help
expect 'on the standard output' says '^  --scene FILE'
expect 'a program runs by its short name' kerf_gives 0 record plot --out "$lab/plot.svg"
expect 'with its arguments' called "^record plot --out $lab/plot.svg"
printf '#!/bin/sh\necho "found    omni at /dev/fw1"\necho "missing  /dev/fw1: Permission denied"\necho "         the cure"\n' \
  >"$lab/look"
chmod +x "$lab/look" && ln -sf ../look "$lab/bin/kerf-controller"
expect 'the doctor tells what the controller finds' kerf_gives 0 doctor
expect 'a device' says '^ok .* omni at /dev/fw1'
expect 'and what is missing' says '^warn  /dev/fw1 .*Permission denied'
expect 'with its cure' says '^ *the cure'

# A machine without QEMU, and tests that a stand-in runs in a tree of their own.
mkdir -p "$lab/no-qemu" "$lab/tools" "$lab/tree/.ci" "$lab/tree/build/release"
ln -s /usr/bin/* "$lab/no-qemu"
rm -f "$lab"/no-qemu/{qemu-system-x86_64,busybox}
cp -r "$root/kerf" "$root/cli" "$lab/tree"
cp "$root"/.ci/{later-tests.sh,tests.sh,tiers.txt} "$lab/tree/.ci"
touch "$lab/tree/CMakeLists.txt"  # its sources
printf '#!/bin/sh\n' | tee "$lab/tools/ninja" >"$lab/tree/.ci/packages.sh"
# It knows three tests: one prints $GUEST and is skipped if that is a reason, of two a part is skipped for $PART, if anything.
cat >"$lab/tools/ctest" <<'PROGRAM'
#!/usr/bin/env bash
case "$*" in
  *' -N -L '*)
    printf '  Test #7: %s\n' hil_fuse demo
    exit 0
    ;;
  *' -R ^'*)
    echo "$*" >>"$LAB/tries"
    echo 'skipped: at another try' >build/release/Testing/Temporary/LastTest.log
    exit "$AGAIN"
    ;;
esac
echo "$*" >"$LAB/ctest"
mkdir -p build/release/Testing/Temporary
if [[ -n ${FAILED:-} ]]; then printf '47:%s\n' $FAILED >build/release/Testing/Temporary/LastTestsFailed.log; fi
{
  printf '1/3 Testing: hil_guest\n1/3 Test: hil_guest\n%s\n' "$GUEST"
  for name in load kills; do printf '2/3 Testing: %s\n2/3 Test: %s\n%s\n' "$name" "$name" "${PART:-[doctest] skipped: 0}"; done
} >build/release/Testing/Temporary/LastTest.log
if [[ $GUEST == skipped:* ]]; then
  printf 'The following tests did not run:\n\t  1 - hil_guest (Skipped)\n' | tee build/release/Testing/tests.log
fi
exit "$CTEST"
PROGRAM
chmod +x "$lab"/tools/* "$lab/tree/.ci/packages.sh"
touch "$lab/tree/build/release/configured.log"
printf '%s:INTERNAL=%s\n' CMAKE_HOME_DIRECTORY "$lab/tree" CMAKE_CACHEFILE_DIR "$lab/tree/build/release" \
  >"$lab/tree/build/release/CMakeCache.txt"
# tests_give CODE GUEST CTEST: the exit code of `kerf test` where the test in a guest printed GUEST and
# ctest ended with CTEST.
tests_give() {
  local code=0
  PATH=$lab/tools:$PATH GUEST=$2 CTEST=$3 "$lab/tree/kerf" test >"$lab/said" 2>&1 || code=$?
  [[ $code == "$1" ]]
}
ends_with() { [[ $(tail -n 1 "$lab/said") == "$1" ]]; }
lack=$(PATH=$lab/no-qemu "$root/hil/guest/guest.sh" lacks) || true
expect 'a guest needs QEMU, and one command installs it' \
  test "$lack" == 'guest: no qemu-system-x86_64 busybox; .ci/packages.sh guest installs what lacks'
expect 'the doctor' with PATH="$lab/no-qemu" kerf_gives 0 doctor
expect 'says what lacks' says '^warn  QEMU  *no qemu-system-x86_64 busybox$'
expect 'and the command' says '.ci/packages.sh guest installs what lacks$'
lack="skipped: ${lack#guest: }"
expect 'tests end' tests_give 0 "$lack" 0
expect 'with the same words' ends_with "kerf: test: hil_guest was skipped: ${lack#skipped: }"
expect 'on all cores' grep -q -- "--parallel $(($(nproc) + 1)) " "$lab/ctest"
expect 'those of each change' grep -q -- ' -E .*packages' "$lab/ctest"
expect 'failed ones too' tests_give 1 "$lack" 8
expect 'with the same words' ends_with "kerf: test: hil_guest was skipped: ${lack#skipped: }"
expect 'tests that lack the same' with PART='x.cpp:9: MESSAGE: skipped: no room' tests_give 0 "$lack" 0
expect 'have one line' ends_with 'kerf: test: part of load, part of kills was skipped: no room'
expect 'beside that of another reason' says "^kerf: test: hil_guest was skipped: ${lack#skipped: }\$"
expect 'a test that is skipped without a word' tests_give 0 'skipped:' 0
expect 'has a line too' ends_with 'kerf: test: hil_guest was skipped: its output does not say why'
expect 'with a guest' tests_give 0 '[doctest] Status: SUCCESS!' 0
expect 'nothing is said' ends_with ''
expect 'tests that keep time and pass at another try' with FAILED='hil_fuse demo' with AGAIN=0 tests_give 0 '' 8
expect 'are named with it' ends_with 'kerf: test: passed at a second or third try: hil_fuse demo'
expect 'they alone try again' grep -qF -- '-R ^(hil_fuse|demo)$ ' "$lab/tries"
expect 'the outputs of both are kept' test "$(grep -c 'Test: load\|at another try' "$lab/tree/build/release/Testing/Temporary/LastTest.log")" == 2
expect 'one that fails again' with FAILED=hil_fuse with AGAIN=8 tests_give 1 '' 8
expect 'is named once' ends_with 'kerf: test: these failed, and they keep time; they try again: hil_fuse'
rm "$lab/tries"
expect 'one beside a test that does not keep time' with FAILED='hil_fuse hil' with AGAIN=0 tests_give 1 '' 8
expect 'does not try again' test ! -e "$lab/tries"
expect 'no test of that name, after a run in which one failed' with AGAIN=0 tests_give 1 '' 8
expect 'nothing tries again' test ! -e "$lab/tries"

echo "check-kerf: $checks checks, $failures failed"
((failures == 0))
