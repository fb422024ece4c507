---@brief
---
--- https://github.com/OWNER/NAME
---
--- `idlc`, a compiler and language server for ROS 2 interface files (`.msg`, `.srv`, `.action`)
---
--- Install it with `pip install idlc`, and add the file type:
---
--- ```lua
--- vim.filetype.add({ extension = { msg = 'rosmsg', srv = 'rosmsg', action = 'rosmsg' } })
--- ```

---@type vim.lsp.Config
return {
  -- `rosidlc` is idlc; Cyclone DDS has another program of that name
  cmd = { 'rosidlc', 'lsp' },
  filetypes = { 'rosmsg' },
  -- the whole repository, for references from other packages
  root_markers = { '.git', 'package.xml' },
  settings = { idlc = {} },
  -- a rename edits other buffers too: send their changes at once
  flags = { debounce_text_changes = 0 },
}
