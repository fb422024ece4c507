autocmd BufRead,BufNewFile *.msg,*.srv,*.action setfiletype rosmsg
