-- The server, for `vim.lsp.enable('idlc')`. `rosidlc` is idlc; Cyclone DDS has another program of that name.
return {
  cmd = { 'rosidlc', 'lsp' },
  filetypes = { 'rosmsg' },
  -- the whole workspace if it is a repository, so that users in other packages are found
  root_markers = { '.git', 'package.xml' },
  settings = { idlc = {} },
  -- tell the server of other buffers at once: a rename reads them all
  flags = { debounce_text_changes = 0 },
  -- what is built into the server opens as a document that it has the text of: see plugin/idlc.lua
  capabilities = { workspace = { textDocumentContent = { dynamicRegistration = false } } },
}
