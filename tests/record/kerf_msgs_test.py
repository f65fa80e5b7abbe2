# SPDX-License-Identifier: Apache-2.0
"""The package ros/kerf_msgs: its message is the one that MCAP and bridge have, and ROS 2's own parser reads it where that is there.

    kerf_msgs_test.py ROOT BIN VERSION"""
import pathlib
import re
import subprocess
import sys
import unittest
import xml.etree.ElementTree

ROOT, BIN = (pathlib.Path(sys.argv.pop(1)).resolve() for _ in range(2))
VERSION = sys.argv.pop(1)
PACKAGE = ROOT / "ros/kerf_msgs"
try:
    from rosidl_adapter.parser import parse_message_file
except ImportError:
    parse_message_file = None


class TestKerfMsgs(unittest.TestCase):
    def test_the_message_is_the_program_s(self):
        said = subprocess.run([BIN / "kerf-record", "columns", "--msg"], capture_output=True, text=True, check=True).stdout
        self.assertEqual((PACKAGE / "msg/Tick.msg").read_text(), said, "make it anew: kerf record columns --msg > ros/kerf_msgs/msg/Tick.msg")

    def test_the_package_is_one_of_messages(self):
        package = xml.etree.ElementTree.parse(PACKAGE / "package.xml").getroot()
        self.assertEqual((package.tag, package.get("format")), ("package", "3"))
        text = {one.tag: one.text for one in package}
        self.assertEqual((text["name"], text["version"], text["member_of_group"]), ("kerf_msgs", VERSION, "rosidl_interface_packages"))
        build = (PACKAGE / "CMakeLists.txt").read_text()
        listed = re.search(r"rosidl_generate_interfaces\(\$\{PROJECT_NAME\} (.*)\)", build).group(1)
        self.assertEqual(re.findall(r'"(msg/\w+\.msg)"', listed), [str(path.relative_to(PACKAGE)) for path in sorted(PACKAGE.rglob("*.msg"))])

    @unittest.skipUnless(parse_message_file, "no rosidl_adapter: apt-get install python3-rosidl")
    def test_ros_parses_it(self):
        tick = parse_message_file("kerf_msgs", str(PACKAGE / "msg/Tick.msg"))
        self.assertEqual([field.name for field in tick.fields][:3], ["seq", "tick", "start_ns"])
        self.assertEqual(str({field.name: field.type for field in tick.fields}["position_mm"]), "float64[3]")
        constants = {one.name: (one.type, one.value) for one in tick.constants}
        self.assertEqual(constants["FLAGS_CONTACT"], ("uint32", 4))
        self.assertEqual(constants["FAULT_STALE_INPUT"], ("uint32", 1))


if __name__ == "__main__":
    unittest.main()
