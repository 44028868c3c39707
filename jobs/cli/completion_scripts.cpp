// The scripts that shells load. What is offered they ask the program for (jobs/cli/completion.h): `graze complete --
// WORDS` prints which files fit, then the words.
#include <string>

#include "engine/settings/settings.h"
#include "jobs/cli/completion.h"

namespace graze {
namespace {

constexpr const char* kBash = R"sh(# Completion of graze for bash. Load it by: source <(graze completion bash)
_graze() {
  # bash breaks words at = and :, which are parts of words here: pieces without a blank between them belong together.
  local rest=${COMP_LINE-${COMP_WORDS[*]}} current=${COMP_WORDS[COMP_CWORD]} words=() glued piece i
  for ((i = 0; i <= COMP_CWORD; ++i)); do
    piece=${COMP_WORDS[i]} glued=1
    [[ $rest == [[:blank:]]* ]] && glued=0
    rest=${rest#"${rest%%[![:blank:]]*}"}
    rest=${rest:${#piece}}
    if ((glued && i > 1)); then words[-1]+=$piece; else words+=("$piece"); fi
  done
  local whole=${words[-1]} quote=
  if [[ $whole == [\'\"]* ]]; then quote=${whole:0:1} whole=${whole:1} current=${current#[\'\"]}; fi
  words[-1]=$whole
  [[ $current == [=:] ]] && current=
  local prefix=${whole%"$current"} lines line word file ending
  mapfile -t lines < <("${words[0]/#\~/$HOME}" complete -- "${words[@]:1}" 2>/dev/null)
  COMPREPLY=()
  for line in "${lines[@]:1}"; do
    word=${line%%$'\t'*}
    word=${word#"$prefix"}
    [[ $quote ]] || printf -v word %q "$word"
    COMPREPLY+=("$word")
  done
  ((${#COMPREPLY[@]} == 1)) && [[ ${COMPREPLY[0]} == *[=.] ]] && compopt -o nospace 2>/dev/null
  local -a kinds
  read -ra kinds <<<"${lines[0]}"
  [[ ${kinds[0]} == files || ${kinds[0]} == folders ]] || return 0
  compopt -o filenames 2>/dev/null
  while IFS= read -r file; do
    if [[ -d $file || (${kinds[0]} == files && ${#kinds[@]} == 1) ]]; then
      COMPREPLY+=("$file")
      continue
    fi
    for ending in "${kinds[@]:1}"; do [[ $file == *"$ending" ]] && COMPREPLY+=("$file"); done
  done < <(compgen -f -- "$current")
  return 0
}
complete -F _graze graze
)sh";

constexpr const char* kZsh = R"sh(#compdef graze
# Completion of graze for zsh: a file _graze in a folder of $fpath, or: source <(graze completion zsh)
_graze() {
  local -a lines open closed endings
  local line word what kind
  lines=("${(@f)$("${(Q)words[1]/#\~/$HOME}" complete -- "${(@Q)words[2,CURRENT]}" 2>/dev/null)}")
  kind=${lines[1]}
  for line in "${(@)lines[2,-1]}"; do
    word=${${line%%$'\t'*}//:/\\:} what=
    [[ $line == *$'\t'* ]] && what=":${line#*$'\t'}"
    if [[ $word == *[=.] ]]; then open+=("$word$what"); else closed+=("$word$what"); fi
  done
  (( $#closed )) && _describe -t words graze closed
  (( $#open )) && _describe -t paths path open -S ''
  compset -P '--*='
  case $kind in
    folders) _files -/ ;;
    files) _files ;;
    files*)
      endings=(${=kind})
      _files -g "*(${(j:|:)endings[2,-1]})"
      ;;
  esac
}
if [[ $zsh_eval_context[-1] == loadautofunc ]]; then _graze "$@"; else compdef _graze graze; fi
)sh";

constexpr const char* kFish = R"sh(# Completion of graze for fish. Load it by: graze completion fish | source
function __graze_complete
    set -l words (commandline -opc)
    set -l typed (commandline -ct)
    set -l program (string replace -r '^~' $HOME -- $words[1])
    set -l lines ($program complete -- $words[2..-1] "$typed" 2>/dev/null)
    set -l kinds (string split ' ' -- $lines[1])
    for line in $lines[2..-1]
        echo $line
    end
    switch $kinds[1]
        case folders
            __fish_complete_directories (string replace -r '^--[^=]*=' '' -- $typed)
        case files
            if test (count $kinds) -eq 1
                __fish_complete_path (string replace -r '^--[^=]*=' '' -- $typed)
            else
                for ending in $kinds[2..-1]
                    __fish_complete_suffix (string replace -r '^--[^=]*=' '' -- $typed) $ending
                end
            end
    end
end
complete -c graze -f -a '(__graze_complete)'
)sh";

}  // namespace

std::string completion_script(const std::string& shell) {
  if (shell == "bash") return kBash;
  if (shell == "zsh") return kZsh;
  if (shell == "fish") return kFish;
  throw InputError("completion " + clipped(shell, 80) + ": there are scripts for bash, zsh and fish");
}

}  // namespace graze
