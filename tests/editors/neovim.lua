-- What Neovim shows of a package, as JSON in the file that $SEEN names; `scenario.py` is what it does.
--
-- Keys are typed, and the editor's own functions are called. All of it runs between events, in a
-- coroutine, or the editor could not do what it is asked for.

local PATIENCE = 20000 -- milliseconds that anything may take
local LATER = 500 -- milliseconds after which the server has heard of every buffer
local seen = {}
local script

local function wait(what, check)
  local left = PATIENCE / 20
  while left > 0 do
    local found = check()
    if found then
      return found
    end
    left = left - 1
    vim.defer_fn(function()
      coroutine.resume(script)
    end, 20)
    coroutine.yield()
  end
  error('there was no ' .. what)
end

local function sleep(milliseconds)
  vim.defer_fn(function()
    coroutine.resume(script)
  end, milliseconds)
  coroutine.yield()
end

local function text()
  return table.concat(vim.api.nvim_buf_get_lines(0, 0, -1, false), '\n') .. '\n'
end

local function name(path)
  return vim.fn.fnamemodify(path, ':t')
end

local function type_keys(keys)
  vim.api.nvim_feedkeys(vim.api.nvim_replace_termcodes(keys, true, false, true), 't', false)
end

-- Open a file as it is on disk, with the cursor on a word of a line.
local function open(path, line, word)
  vim.cmd('silent edit! ' .. path)
  local at = line and vim.fn.getline(line):find(word, 1, true)
  vim.api.nvim_win_set_cursor(0, { line or 1, (at or 1) - 1 })
end

-- All files of the workspace by path, as buffers have them, or as they are on disk.
local function disk(of_buffers)
  local found = {}
  for _, path in ipairs(vim.fn.systemlist({ 'find', '.', '-type', 'f', '-not', '-path', './.git/*' })) do
    local short = path:sub(3)
    local buffer = of_buffers and vim.fn.bufnr('^' .. vim.fn.fnamemodify(short, ':p') .. '$') or -1
    local is_loaded = buffer > 0 and vim.api.nvim_buf_is_loaded(buffer)
    local lines = is_loaded and vim.api.nvim_buf_get_lines(buffer, 0, -1, false) or vim.fn.readfile(short)
    found[short] = table.concat(lines, '\n') .. '\n'
  end
  return found
end

local function files()
  return disk(true)
end

local function problems()
  local found = {}
  for _, one in ipairs(vim.diagnostic.get(0)) do
    local marked = vim.fn.getline(one.lnum + 1):sub(one.col + 1, one.end_col)
    table.insert(found, { one.code .. ': ' .. one.message, marked })
  end
  return #found > 0 and found
end

local function places(list)
  local found = {}
  for _, one in ipairs(list) do
    table.insert(found, { name(vim.fn.bufname(one.bufnr)), one.lnum, one.text })
  end
  return #found > 0 and found
end

-- What a command put into the list of places.
local function listed(what, command)
  vim.fn.setqflist({})
  vim.fn.setloclist(0, {})
  command()
  local found = wait(what, function()
    return places(vim.fn.getqflist()) or places(vim.fn.getloclist(0))
  end)
  vim.cmd('silent! cclose | silent! lclose')
  return found
end

local look = {
  diagnostic = function()
    open('msg/Broken.msg')
    return wait('problem', problems)
  end,
  fix = function()
    open('msg/Broken.msg', 1, 'flot64')
    wait('problem', problems)
    vim.ui.select = function(actions, _, choose)
      choose(actions[1], 1)
    end
    local before = text()
    vim.lsp.buf.code_action()
    wait('fix', function()
      return text() ~= before and not problems()
    end)
    return text()
  end,
  hover = function()
    open('msg/Fleet.msg', 1, 'Drive')
    vim.lsp.buf.hover()
    return wait('window', function()
      for _, window in ipairs(vim.api.nvim_list_wins()) do
        if vim.api.nvim_win_get_config(window).relative ~= '' then
          local lines = vim.api.nvim_buf_get_lines(vim.api.nvim_win_get_buf(window), 0, -1, false)
          vim.api.nvim_win_close(window, true)
          return table.concat(lines, '\n')
        end
      end
    end)
  end,
  definition = function()
    open('msg/Fleet.msg', 1, 'Drive')
    vim.lsp.buf.definition()
    wait('jump', function()
      return name(vim.fn.bufname()) ~= 'Fleet.msg'
    end)
    return name(vim.fn.bufname())
  end,
  built_in = function()
    open('msg/Drive.msg', 3, 'Header')
    vim.lsp.buf.definition()
    wait('jump', function()
      return name(vim.fn.bufname()) == 'Header.msg'
    end)
    return { language = vim.bo.filetype, text = text() }
  end,
  references = function()
    open('msg/Fleet.msg', 1, 'Drive')
    return listed('reference', function()
      vim.lsp.buf.references()
    end)
  end,
  completion = function()
    open('msg/Fleet.msg')
    type_keys('Gostd_msgs/Head<C-x><C-o>')
    wait('menu', function()
      return vim.fn.pumvisible() == 1
    end)
    local words = {}
    for _, one in ipairs(vim.fn.complete_info({ 'items' }).items) do
      table.insert(words, one.abbr ~= '' and one.abbr or one.word)
    end
    type_keys('<C-y><Esc>')
    wait('end', function()
      return vim.fn.mode() == 'n'
    end)
    return { words = words, line = vim.fn.getline('.') }
  end,
  rename = function()
    open('msg/Drive.msg', 4, 'speed')
    vim.lsp.buf.rename('velocity')
    wait('rename', function()
      return text():find('velocity', 1, true)
    end)
    return text()
  end,
  format = function()
    open('msg/Untidy.msg')
    local format = vim.lsp.buf.format or vim.lsp.buf.formatting_sync
    format()
    return text()
  end,
  symbol = function()
    open('msg/Drive.msg')
    return listed('symbol', function()
      vim.lsp.buf.document_symbol()
    end)
  end,
  -- the key for it, as the plugin leaves it
  tag = vim.lsp.enable and function()
    open('msg/Drive.msg', 3, 'Header')
    type_keys('<C-]>')
    wait('jump', function()
      return name(vim.fn.bufname()) == 'Header.msg'
    end)
    return text()
  end,
  renaming = function()
    local steps = {}
    local function rename(new)
      vim.api.nvim_set_current_buf(vim.fn.bufnr('Robot.msg'))
      vim.api.nvim_win_set_cursor(0, { 1, 6 })
      vim.lsp.buf.rename(new)
      wait('rename', function()
        return text():find('base/' .. new .. ' ', 1, true)
          and vim.fn.filereadable('base/msg/' .. new .. '.msg') == 1
      end)
      table.insert(steps, { new, files() })
      sleep(LATER)
    end
    local function save()
      vim.cmd('silent wall')
      wait('end of errors', function()
        -- an old one keeps those of deleted buffers, where nobody sees them
        return #vim.tbl_filter(function(problem)
          return vim.api.nvim_buf_is_valid(problem.bufnr)
        end, vim.diagnostic.get(nil, { severity = vim.diagnostic.severity.ERROR })) == 0
      end)
      table.insert(steps, { 'disk', disk() })
    end
    rename('Waypoint')
    rename('Pose') -- undo, before anything is saved
    rename('Waypoint') -- redo
    save()
    vim.cmd('edit base/CMakeLists.txt')
    vim.api.nvim_buf_set_lines(0, 0, 0, false, { '# not saved' })
    sleep(LATER)
    rename('Pose')
    save()
    return steps
  end,
  inlay_hint = vim.lsp.inlay_hint and function()
    open('msg/Drive.msg')
    vim.lsp.inlay_hint.enable(true)
    return wait('hint', function()
      local found = {}
      for _, one in ipairs(vim.lsp.inlay_hint.get({ bufnr = 0 })) do
        local label = one.inlay_hint.label
        if type(label) == 'table' then
          label = label[1].value
        end
        table.insert(found, { one.inlay_hint.position.line, label })
      end
      return #found > 0 and found
    end)
  end,
  update = function()
    vim.fn.writefile(vim.split(vim.env.SETTINGS, '\n'), 'pyproject.toml')
    open('msg/Untidy.msg')
    vim.ui.select = function(actions, _, choose)
      choose(actions[1], 1)
    end
    local context = { only = { 'source.updateGenerated' }, diagnostics = {} }
    vim.lsp.buf.code_action(vim.lsp.enable and { context = context } or context)
    return wait('generated package', function()
      return vim.fn.filereadable('out/demo_msgs/msg/_untidy.py') == 1
    end)
  end,
}

local CAPABILITIES = vim.tbl_filter(function(one)
  return look[one]
end, vim.split(vim.env.LOOK, ' '))

local function main()
  vim.o.completeopt = 'menuone'
  vim.o.hidden = true -- as it is in newer ones
  open(vim.env.FIRST)
  wait('server', function()
    local clients = vim.lsp.get_clients or vim.lsp.buf_get_clients
    for _, client in pairs(clients()) do
      return client.initialized
    end
  end)
  for _, capability in ipairs(CAPABILITIES) do
    local ok, found = pcall(look[capability])
    seen[capability] = ok and found or { failed = found }
    for _, buffer in ipairs(vim.api.nvim_list_bufs()) do
      if vim.bo[buffer].modified then
        vim.api.nvim_buf_call(buffer, function()
          vim.cmd('silent edit!')
        end)
      end
    end
  end
  vim.cmd('silent edit! ' .. vim.env.FIRST)
  seen.language = vim.bo.filetype
  seen.syntax = vim.fn.synIDattr(vim.fn.synID(4, 1, 1), 'name')
end

local function run()
  local ok, problem = pcall(main)
  if not ok then
    seen.failed = problem
  end
  vim.fn.writefile({ vim.fn.json_encode(seen) }, vim.env.SEEN)
  vim.cmd('qa!')
end

script = coroutine.create(run)
vim.defer_fn(function()
  coroutine.resume(script)
end, 0)
