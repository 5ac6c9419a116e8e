# SPDX-License-Identifier: Apache-2.0 WITH LLVM-exception
#
# complete.sh FILE WORD... prints what bash completes the last word to, as FILE says.
source "$1"
shift
COMP_WORDS=("$@")
COMP_CWORD=$(($# - 1))
function=$(complete -p "$1" | sed 's/.* -F \([^ ]*\) .*/\1/')
"$function"
printf '%s\n' "${COMPREPLY[@]}"
