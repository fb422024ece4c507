vim.filetype.add({ extension = { msg = 'rosmsg', srv = 'rosmsg', action = 'rosmsg' } })
