;;; rosmsg-mode.el --- Major mode for ROS 2 interface files  -*- lexical-binding: t -*-

;; Author: The idlc authors
;; URL: https://github.com/OWNER/NAME
;; Version: 0.2.0
;; Package-Requires: ((emacs "28.1") (eglot "1.9"))
;; Keywords: languages, tools
;; SPDX-License-Identifier: Apache-2.0

;;; Commentary:

;; This package highlights .msg, .srv and .action files, and registers the language server of idlc
;; with Eglot.  `eglot-rename' on a message also renames its file, edits the files that use the
;; message, and saves them, with versions of Eglot that cannot rename files too.
;;
;; To install the server and start it with each file:
;;
;;     pip install idlc
;;
;;     (add-hook 'rosmsg-mode-hook #'eglot-ensure)

;;; Code:

(require 'cl-lib)
(require 'eglot)
(require 'seq)

(defvar rosmsg-mode-syntax-table
  (let ((table (make-syntax-table)))
    (modify-syntax-entry ?# "<" table)
    (modify-syntax-entry ?\n ">" table)
    ;; as in ROS 2, a # ends quoted text, and unquoted text may have one quotation mark
    (modify-syntax-entry ?\" "." table)
    table)
  "Syntax table of `rosmsg-mode'.")

(defvar rosmsg-mode-font-lock-keywords
  (let ((type (concat "^[ \t]*\\(?:@optional[ \t]+\\)*\\([^][ \t\n#<=@]+\\)"
                      "\\(?:[][<=@][^ \t\n#]*\\)?")))
    `(("^---$" . font-lock-preprocessor-face)
      ("^[ \t]*\\(@optional\\)\\_>" 1 font-lock-keyword-face)
      (,type 1 font-lock-type-face)
      (,(concat type "[ \t]+\\([A-Za-z][A-Za-z0-9_]*\\)[ \t]*=") 2 font-lock-constant-face)
      (,(concat type "[ \t]+\\([A-Za-z][A-Za-z0-9_]*\\)") 2 font-lock-variable-name-face)
      ("\"\\(?:[^\"\\#\n]\\|\\\\[^#\n]\\)*\"" . font-lock-string-face)
      ("'\\(?:[^'\\#\n]\\|\\\\[^#\n]\\)*'" . font-lock-string-face)
      ("#" ("\\[[^][\n]+\\]" nil nil (0 font-lock-constant-face t)) ; units
       ("idlc:[ \t]*ignore" nil nil (0 font-lock-warning-face t)))))
  "Patterns to highlight in `rosmsg-mode'.")

;;;###autoload
(define-derived-mode rosmsg-mode prog-mode "ROS 2 interface"
  "Major mode for ROS 2 interface files."
  (setq-local comment-start "# "
              comment-start-skip "#+[ \t]*"
              font-lock-defaults '(rosmsg-mode-font-lock-keywords)))

;;;###autoload
(add-to-list 'auto-mode-alist '("\\.\\(?:msg\\|srv\\|action\\)\\'" . rosmsg-mode))

(defclass rosmsg-server (eglot-lsp-server) ()
  :documentation "The language server of idlc.")

;; Cyclone DDS has another program that is called idlc.
(add-to-list 'eglot-server-programs '(rosmsg-mode . (rosmsg-server "rosidlc" "lsp")))

(defvar rosmsg--eglot-renames nil
  "Whether Eglot renames files by itself.")

(cl-defmethod eglot-client-capabilities ((_server rosmsg-server))
  "Return what Eglot can do, and that files can be renamed."
  (let* ((all (copy-tree (cl-call-next-method)))
         (workspace (plist-get all :workspace))
         (edit (plist-get workspace :workspaceEdit)))
    (setq rosmsg--eglot-renames (plist-get edit :resourceOperations))
    (unless rosmsg--eglot-renames
      (setq edit (append edit '(:resourceOperations ["rename"]))))
    (plist-put all :workspace (plist-put workspace :workspaceEdit edit))))

(defun rosmsg--path (uri)
  "Return the path of a URI."
  (funcall (if (fboundp 'eglot-uri-to-path) 'eglot-uri-to-path 'eglot--uri-to-path) uri))

(defun rosmsg--rename-file (move)
  "Rename the file of the operation MOVE, with its buffer."
  (let* ((old (rosmsg--path (plist-get move :oldUri)))
         (new (rosmsg--path (plist-get move :newUri)))
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

(defun rosmsg--apply (apply-edit edit &rest arguments)
  "Call APPLY-EDIT with EDIT and ARGUMENTS, and rename the files that EDIT renames."
  (let* ((changes (append (plist-get edit :documentChanges) nil))
         (moves (seq-filter (lambda (change) (equal (plist-get change :kind) "rename")) changes))
         (texts (seq-difference changes moves)))
    (if (or rosmsg--eglot-renames (null moves))
        (apply apply-edit edit arguments)
      (dolist (move moves)
        (when (file-exists-p (rosmsg--path (plist-get move :newUri)))
          (user-error "File %s exists" (plist-get move :newUri))))
      (apply apply-edit (list :documentChanges (vconcat texts)) arguments)
      ;; the server reads CMakeLists.txt from disk
      (dolist (text texts)
        (with-current-buffer
            (find-file-noselect (rosmsg--path (plist-get (plist-get text :textDocument) :uri)))
          (save-buffer)))
      (mapc #'rosmsg--rename-file moves))))

(defun rosmsg--save-build-files (&rest _)
  "Save each CMakeLists.txt: a rename may edit it."
  (when (derived-mode-p 'rosmsg-mode)
    (dolist (buffer (buffer-list))
      (let ((file (buffer-file-name buffer)))
        (when (and file (string= (file-name-nondirectory file) "CMakeLists.txt"))
          (with-current-buffer buffer (save-buffer)))))))

(advice-add 'eglot--apply-workspace-edit :around #'rosmsg--apply)
(advice-add 'eglot-rename :before #'rosmsg--save-build-files)

(provide 'rosmsg-mode)
;;; rosmsg-mode.el ends here
