-- Starts the server for interface files, and shows the interfaces that are built into it.

if not vim.lsp.enable then
  return -- before Neovim 0.11, somebody else has to start it; there is a description in docs/editors.md
end

-- `idlc:///jazzy/std_msgs/msg/Header.msg` is a document that only the server has.
vim.api.nvim_create_autocmd('BufReadCmd', {
  group = vim.api.nvim_create_augroup('idlc', {}),
  pattern = 'idlc:*',
  callback = function(event)
    local client = vim.lsp.get_clients({ name = 'idlc' })[1]
    local params = { uri = event.match }
    local answer = client and client:request_sync('workspace/textDocumentContent', params, 10000)
    if not (answer and answer.result) then
      vim.notify('idlc: there is no ' .. event.match, vim.log.levels.ERROR)
      return
    end
    vim.api.nvim_buf_set_lines(event.buf, 0, -1, false, vim.split(answer.result.text, '\n'))
    vim.bo[event.buf].buftype = 'nofile'
    vim.bo[event.buf].modifiable = false
    vim.bo[event.buf].filetype = 'rosmsg'
  end,
})

vim.lsp.enable('idlc')
