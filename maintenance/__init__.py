"""For the people who maintain idlc: releases, the documentation site, what CI installs."""
