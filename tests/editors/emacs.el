;;; What Emacs shows of a package, as JSON in the file that $SEEN names. -*- lexical-binding: t -*-

(require 'eglot)
(require 'json)
(require 'imenu)
(load (getenv "LINES") nil t)   ; the lines of docs/editors.md

(defvar seen nil)
(defvar root default-directory)
(setq eglot-sync-connect 60 eglot-connect-timeout 60
      eglot-confirm-server-initiated-edits nil
      make-backup-files nil)

(defun wait-for (what check)
  "Return what CHECK finds; fail if there is no WHAT after a while."
  (let ((left 1000) found)
    (while (not (or (setq found (funcall check)) (zerop left)))
      (accept-process-output nil 0.02)
      (setq left (1- left)))
    (or found (error "There was no %s" what))))

(defun open (path &optional word)
  "Edit the file PATH as it is on disk, with the cursor on WORD."
  (find-file (expand-file-name path root))
  (revert-buffer t t)
  (eglot--maybe-activate-editing-mode)
  (goto-char (point-min))
  (when word (search-forward word) (goto-char (match-beginning 0))))

(defun text () (buffer-substring-no-properties (point-min) (point-max)))

(defun problems ()
  (flymake-start)
  (flymake-diagnostics))

(defun place (item)
  (let ((marker (xref-location-marker (xref-item-location item))))
    (list (file-name-nondirectory (buffer-file-name (marker-buffer marker)))
          (with-current-buffer (marker-buffer marker) (line-number-at-pos marker)))))

(defun names (index)
  "Return the names in an INDEX of imenu."
  (apply #'append
         (mapcar (lambda (one)
                   (cond ((imenu--subalist-p one) (names (cdr one)))
                         ((stringp (car one)) (list (substring-no-properties (car one))))))
                 index)))

(defmacro look (name &rest body)
  "Note under NAME what BODY returns, or why it failed."
  `(push (cons ,name (condition-case problem (progn ,@body)
                       (error (list (cons "failed" (error-message-string problem))))))
         seen))

(defun disk ()
  "Return the files of the two packages by path, as they are on disk."
  (mapcar (lambda (path)
            (cons (file-relative-name path root)
                  (with-temp-buffer (insert-file-contents path) (buffer-string))))
          (cl-mapcan (lambda (one) (directory-files-recursively (expand-file-name one root) "."))
                     (list "base" "fleet"))))

(defun rename-message (name)
  "Rename the message that Robot.msg uses, and return the files."
  (find-file (expand-file-name "fleet/msg/Robot.msg" root))
  (goto-char (point-min))
  (forward-char 6)
  (eglot-rename name)
  (disk))

(defun finish ()
  (dolist (buffer (buffer-list)) (with-current-buffer buffer (set-buffer-modified-p nil)))
  (ignore-errors (eglot-shutdown-all))
  (with-temp-file (getenv "SEEN") (insert (json-encode seen)))
  (kill-emacs))

(when (file-exists-p "fleet")
  (fset 'y-or-n-p (lambda (&rest _) t))   ; the question whether to edit files that are not open
  (find-file "base/msg/Pose.msg")
  (apply #'eglot--connect (eglot--guess-contact))
  (find-file "fleet/msg/Robot.msg")
  (eglot--maybe-activate-editing-mode)
  (look "renaming"
        (let ((default-directory root))
          (vector (rename-message "Waypoint")
                  (rename-message "Pose")      ; undo
                  (rename-message "Waypoint")  ; redo
                  (progn (find-file (expand-file-name "base/CMakeLists.txt" root))
                         (goto-char (point-min))
                         (insert "# not saved\n")
                         (rename-message "Pose")))))
  (push (cons "buffers" (vconcat (delq nil (mapcar #'buffer-file-name (buffer-list))))) seen)
  (finish))

(find-file "msg/Drive.msg")
(push (cons "language" (symbol-name major-mode)) seen)
(apply #'eglot--connect (eglot--guess-contact))

(defun faces (text)
  "Return the parts of a TEXT that have a face, each with its face."
  (with-temp-buffer
    (insert text)
    (delay-mode-hooks (rosmsg-mode))
    (font-lock-ensure)
    (let ((start (point-min)) parts)
      (while (< start (point-max))
        (let ((end (next-single-property-change start 'face nil (point-max)))
              (face (get-text-property start 'face)))
          (when face (push (vector (buffer-substring-no-properties start end) face) parts))
          (setq start end)))
      (vconcat (nreverse parts)))))

(look "faces" (faces (getenv "TEXT")))
(look "diagnostic"
      (open "msg/Broken.msg")
      (vconcat (mapcar (lambda (one)
                         (vector (flymake-diagnostic-text one)
                                 (buffer-substring-no-properties
                                  (flymake-diagnostic-beg one) (flymake-diagnostic-end one))))
                       (wait-for "problem" #'problems))))
(look "fix"
      (open "msg/Broken.msg" "flot64")
      (wait-for "problem" #'problems)
      (eglot-code-actions (point) (point) "quickfix" t)
      (text))
(look "hover"
      (open "msg/Fleet.msg" "Drive")
      (let (shown)
        (eglot-hover-eldoc-function (lambda (said &rest _) (setq shown said)))
        (substring-no-properties (wait-for "help" (lambda () shown)))))
(look "definition"
      (open "msg/Fleet.msg" "Drive")
      (let ((xref-prompt-for-identifier nil))
        (call-interactively #'xref-find-definitions))
      (file-name-nondirectory (buffer-file-name)))
(look "built_in"
      (open "msg/Drive.msg" "Header")
      (let ((xref-prompt-for-identifier nil))
        (call-interactively #'xref-find-definitions))
      (text))
(look "references"
      (open "msg/Fleet.msg" "Drive")
      (vconcat (mapcar #'place (xref-backend-references 'eglot (xref-backend-identifier-at-point 'eglot)))))
(look "completion"
      (open "msg/Fleet.msg")
      (goto-char (point-max))
      (insert "std_msgs/Head")
      (let* ((found (eglot-completion-at-point))
             (typed (buffer-substring-no-properties (nth 0 found) (nth 1 found)))
             (words (all-completions typed (nth 2 found))))
        (completion-at-point)
        (list (cons "words" (vconcat (mapcar #'substring-no-properties words)))
              (cons "line" (buffer-substring-no-properties
                            (line-beginning-position) (line-end-position))))))
(look "rename"
      (open "msg/Drive.msg" "speed")
      (eglot-rename "velocity")
      (text))
(look "format"
      (open "msg/Untidy.msg")
      (eglot-format-buffer)
      (text))
(look "symbol"
      (open "msg/Drive.msg")
      (setq imenu--index-alist nil)
      (vconcat (names (funcall imenu-create-index-function))))
(look "update"
      (write-region (getenv "SETTINGS") nil (expand-file-name "pyproject.toml" root))
      (mapc #'open '("msg/Fleet.msg" "msg/Drive.msg" "msg/Broken.msg" "msg/Untidy.msg"))
      (eglot-code-actions (point-min) (point-max) "source.updateGenerated.idlc" t)
      (file-exists-p (expand-file-name "out/demo_msgs/msg/_untidy.py" root)))

(finish)
