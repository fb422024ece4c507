"""Versions of interfaces, and rules."""

from __future__ import annotations

import atexit
import os
from pathlib import Path
import tempfile

# From version 3 on, as in Kilted, Fast DDS keeps one definition of each type name in a process. It
# sends this definition to other processes, which do not connect if they have another version. With
# this profile, it sends no definitions. A profile of your own needs the same property.
PROFILE = """\
<?xml version="1.0" encoding="UTF-8"?>
<dds xmlns="http://www.eprosima.com">
  <profiles>
    <participant profile_name="versions" is_default_profile="true">
      <rtps>
        <propertiesPolicy>
          <properties>
            <property>
              <name>fastdds.type_propagation</name>
              <value>disabled</value>
            </property>
          </properties>
        </propertiesPolicy>
      </rtps>
    </participant>
  </profiles>
</dds>
"""

if 'FASTDDS_DEFAULT_PROFILES_FILE' not in os.environ:
    file, path = tempfile.mkstemp(suffix='.xml')
    atexit.register(Path(path).unlink, missing_ok=True)
    with os.fdopen(file, 'w') as profile:
        profile.write(PROFILE)
    os.environ['FASTDDS_DEFAULT_PROFILES_FILE'] = path
