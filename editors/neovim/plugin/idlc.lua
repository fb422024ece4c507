-- Starts the server for interface files, and shows the interfaces that are built into it.

local MARKERS = { '.git', 'package.xml' }

-- Return the nearest folder above a buffer's file that has a file of this name.
local function above(buffer, name)
  local folder = vim.api.nvim_buf_get_name(buffer)
  while folder ~= vim.fn.fnamemodify(folder, ':h') do
    folder = vim.fn.fnamemodify(folder, ':h')
    if vim.loop.fs_stat(folder .. '/' .. name) then
      return folder
    end
  end
end

-- Call a function for CMakeLists.txt of a package with interfaces. A rename edits this file as well,
-- so the server has to know what is not saved of it.
local function on_build_file(start)
  vim.api.nvim_create_autocmd('FileType', {
    group = 'idlc',
    pattern = 'cmake',
    callback = function(event)
      local folder, name = vim.api.nvim_buf_get_name(event.buf):match('^(.*)/([^/]*)$')
      for _, kind in ipairs(name == 'CMakeLists.txt' and { 'msg', 'srv', 'action' } or {}) do
        if vim.loop.fs_stat(folder .. '/' .. kind) then
          return start(event.buf, above(event.buf, MARKERS[1]) or above(event.buf, MARKERS[2]))
        end
      end
    end,
  })
end

vim.api.nvim_create_augroup('idlc', {})

if not vim.lsp.enable then -- before Neovim 0.11
  local clients = {}
  local function attach(buffer, root)
    local folder = root or vim.fn.getcwd()
    clients[folder] = clients[folder]
      or vim.lsp.start_client({
        name = 'idlc',
        cmd = { 'rosidlc', 'lsp' },
        root_dir = folder,
        flags = { debounce_text_changes = 0 },
        on_exit = function()
          clients[folder] = nil
        end,
      })
    vim.lsp.buf_attach_client(buffer, clients[folder])
  end
  vim.api.nvim_create_autocmd('FileType', {
    group = 'idlc',
    pattern = 'rosmsg',
    callback = function(event)
      vim.bo[event.buf].omnifunc = 'v:lua.vim.lsp.omnifunc'
      attach(event.buf, above(event.buf, MARKERS[1]) or above(event.buf, MARKERS[2]))
    end,
  })
  on_build_file(attach)
  return
end

-- `idlc:///jazzy/std_msgs/msg/Header.msg` is a document that only the server has. CTRL-] takes its
-- name for that of a file, and leaves one slash of it.
vim.api.nvim_create_autocmd('BufReadCmd', {
  group = 'idlc',
  pattern = { 'idlc:*', 'idlc:/*' },
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

vim.lsp.config('idlc', { capabilities = { workspace = { textDocumentContent = { dynamicRegistration = false } } } })
vim.lsp.enable('idlc')
on_build_file(function(buffer, root)
  vim.lsp.start(vim.tbl_extend('force', vim.lsp.config.idlc, { root_dir = root }), { bufnr = buffer })
end)
