;;; idlc.el --- ROS 2 interface files, served by idlc  -*- lexical-binding: t -*-

;;; Commentary:

;; A mode for .msg, .srv and .action files, and their language server in Eglot.  Eglot itself does
;; not rename files for a server; this adds it, so that `eglot-rename' on a message renames its file
;; and edits its users and CMakeLists.txt.  What a rename edits is saved.

;;; Code:

(require 'cl-lib)
(require 'eglot)
(require 'seq)

(define-derived-mode rosmsg-mode prog-mode "ROS 2 interface"
  "Major mode for ROS 2 interface files."
  (setq-local comment-start "# "))

(defclass idlc-server (eglot-lsp-server) ()
  :documentation "The language server of idlc.")

;; Cyclone DDS has another program that is called idlc.
(add-to-list 'eglot-server-programs '(rosmsg-mode . (idlc-server "rosidlc" "lsp")))
(add-to-list 'auto-mode-alist '("\\.\\(msg\\|srv\\|action\\)\\'" . rosmsg-mode))
(add-hook 'rosmsg-mode-hook #'eglot-ensure)

(defvar idlc--eglot-renames nil
  "Whether Eglot renames files by itself.")

(cl-defmethod eglot-client-capabilities ((_server idlc-server))
  "Return what Eglot can do, and that files can be renamed."
  (let* ((all (copy-tree (cl-call-next-method)))
         (workspace (plist-get all :workspace))
         (edit (plist-get workspace :workspaceEdit)))
    (setq idlc--eglot-renames (plist-get edit :resourceOperations))
    (unless idlc--eglot-renames
      (setq edit (append edit '(:resourceOperations ["rename"]))))
    (plist-put all :workspace (plist-put workspace :workspaceEdit edit))))

(defun idlc--path (uri)
  "Return the path of a URI."
  (funcall (if (fboundp 'eglot-uri-to-path) 'eglot-uri-to-path 'eglot--uri-to-path) uri))

(defun idlc--rename-file (move)
  "Rename a file with its buffer, as the operation MOVE says."
  (let* ((old (idlc--path (plist-get move :oldUri)))
         (new (idlc--path (plist-get move :newUri)))
         (buffer (find-buffer-visiting old)))
    (if (null buffer)
        (rename-file old new)
      (with-current-buffer buffer
        (save-buffer)
        (let ((is-managed (eglot-managed-p)))
          (when is-managed (eglot--signal-textDocument/didClose))
          (rename-file old new)
          (set-visited-file-name new t t)
          (when (boundp 'eglot--TextDocumentIdentifier-cache)
            (set 'eglot--TextDocumentIdentifier-cache nil))
          (when is-managed (eglot--signal-textDocument/didOpen)))))))

(defun idlc--apply (apply-edit edit &rest arguments)
  "Call APPLY-EDIT with EDIT and ARGUMENTS, and rename the files that EDIT renames."
  (let* ((changes (append (plist-get edit :documentChanges) nil))
         (moves (seq-filter (lambda (one) (equal (plist-get one :kind) "rename")) changes))
         (texts (seq-difference changes moves)))
    (if (or idlc--eglot-renames (null moves))
        (apply apply-edit edit arguments)
      (dolist (move moves)
        (when (file-exists-p (idlc--path (plist-get move :newUri)))
          (user-error "There is a file %s" (plist-get move :newUri))))
      (apply apply-edit (list :documentChanges (vconcat texts)) arguments)
      ;; the server does not see the buffer of CMakeLists.txt, so the file has to say the same
      (dolist (one texts)
        (with-current-buffer
            (find-file-noselect (idlc--path (plist-get (plist-get one :textDocument) :uri)))
          (save-buffer)))
      (mapc #'idlc--rename-file moves))))

(defun idlc--save-build-files (&rest _)
  "Save each CMakeLists.txt, which a rename may edit."
  (when (derived-mode-p 'rosmsg-mode)
    (dolist (buffer (buffer-list))
      (let ((file (buffer-file-name buffer)))
        (when (and file (string= (file-name-nondirectory file) "CMakeLists.txt"))
          (with-current-buffer buffer (save-buffer)))))))

(advice-add 'eglot--apply-workspace-edit :around #'idlc--apply)
(advice-add 'eglot-rename :before #'idlc--save-build-files)

(provide 'idlc)
;;; idlc.el ends here
