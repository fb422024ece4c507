" Colours of ROS 2 interface files; those that the server sends lie over them.
if exists('b:current_syntax')
  finish
endif

syntax match rosmsgSeparator /^---$/
syntax match rosmsgOptional /^\s*@optional\>/ nextgroup=rosmsgPrimitive,rosmsgType skipwhite
syntax match rosmsgType /^\s*\zs[^ \t#<=@[\]]\+/ nextgroup=rosmsgBound
syntax match rosmsgType /[^ \t#<=@[\]]\+/ contained nextgroup=rosmsgBound
syntax match rosmsgPrimitive /^\s*\zs\%(bool\|byte\|char\|float\%(32\|64\)\|u\?int\%(8\|16\|32\|64\)\|w\?string\)\>\/\@!/ nextgroup=rosmsgBound
syntax match rosmsgPrimitive /\%(bool\|byte\|char\|float\%(32\|64\)\|u\?int\%(8\|16\|32\|64\)\|w\?string\)\>\/\@!/ contained nextgroup=rosmsgBound
syntax match rosmsgBound /[][<=0-9]\+/ contained
syntax match rosmsgConstant /\<\h\w*\ze\s*=/
syntax match rosmsgNumber /[ =,[]\@1<=[+-]\?\d[0-9a-zA-Z_.]*\%([eE][+-]\?\d\+\)\?/
syntax match rosmsgBoolean /[ =,[]\@1<=\c\%(true\|false\)\>/
syntax match rosmsgString /"\%([^"\\#]\|\\[^#]\)*"\|'\%([^'\\#]\|\\[^#]\)*'/
syntax match rosmsgComment /#.*/ contains=rosmsgUnit,rosmsgRemark,@Spell
syntax match rosmsgUnit /\[[^][]\+\]/ contained
syntax match rosmsgRemark /idlc:\s*ignore/ contained

highlight default link rosmsgSeparator PreProc
highlight default link rosmsgOptional StorageClass
highlight default link rosmsgType Structure
highlight default link rosmsgPrimitive Type
highlight default link rosmsgBound Number
highlight default link rosmsgConstant Constant
highlight default link rosmsgNumber Number
highlight default link rosmsgBoolean Boolean
highlight default link rosmsgString String
highlight default link rosmsgComment Comment
highlight default link rosmsgUnit SpecialComment
highlight default link rosmsgRemark Todo

let b:current_syntax = 'rosmsg'
