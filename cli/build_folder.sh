# SPDX-License-Identifier: Apache-2.0
# shellcheck shell=bash
# Sourced by ./kerf and .ci: whose a build folder is. CMake's cache, ninja's commands and joined files have absolute paths, so a
# build folder that came with a copied, renamed or mounted clone builds the sources of the first folder, and writes there.

# cached FILE KEY: the value of a key of a CMakeCache.txt.
cached() { sed -n "s/^$2:INTERNAL=//p" "$1"; }

# made_for ROOT DIR: prints the source folder that the build folder DIR was configured for, if that is not ROOT or if DIR has
# moved since; else returns 1. ROOT has no symbolic link in it.
made_for() {
  local cache=$2/CMakeCache.txt home
  [[ -e $cache ]] || return 1
  home=$(cached "$cache" CMAKE_HOME_DIRECTORY)
  if [[ $(readlink -m -- "$home") == "$1" &&
    $(readlink -m -- "$(cached "$cache" CMAKE_CACHEFILE_DIR)") == $(readlink -m -- "$2") ]]; then
    return 1
  fi
  echo "${home:-another folder}"
}

# own_folder ROOT DIR: makes sure that nothing of another clone is left in DIR once CMake has configured it with the options
# `anew`, which are set here: none, or a cache from scratch with the settings of the old one.
own_folder() {
  local home
  anew=()
  home=$(made_for "$1" "$2") || return 0
  if [[ $(readlink -m -- "$2") != "$1"/* ]]; then  # a link, copied with the clone
    echo "kerf: $2: leads to a build folder of $home; remove that link, then start again" >&2
    exit 2
  fi
  echo "kerf: ${2#"$1"/} was made for $home; it is configured and built anew for $1" >&2
  mapfile -t anew < <(sed -nE 's/^(KERF_[A-Z_]+:(BOOL|STRING)=.*)$/-D\1/p' "$2/CMakeCache.txt")
  anew+=(--fresh)
  rm -rf "${2:?}/bin" "$2/stand-in" "$2/configured.log"
}
