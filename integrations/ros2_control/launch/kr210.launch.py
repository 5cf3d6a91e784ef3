"""Starts the KR 210 class arm under a joint trajectory controller.

    ros2 launch flexarm_ros2_control kr210.launch.py
"""
from pathlib import Path
from xml.etree import ElementTree

from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue

SHARE = Path(get_package_share_directory("flexarm_ros2_control"))
CONTROLLERS = ["joint_state_broadcaster", "arm_controller", "tcp_broadcaster"]


def robot_description(robot: Path, tag: Path) -> str:
    """Returns the URDF of a robot with a ros2_control tag, and with paths that every node finds."""
    urdf = ElementTree.parse(robot / f"{robot.name}.urdf").getroot()
    for mesh in urdf.iter("mesh"):
        mesh.set("filename", (robot / mesh.get("filename")).as_uri())
    for control in ElementTree.parse(tag).getroot().iter("ros2_control"):
        control.find("hardware/param[@name='robot']").text = str(robot)
        urdf.append(control)
    return ElementTree.tostring(urdf, encoding="unicode")


def nodes(context):
    """Returns the nodes for the arguments of the launch."""
    robot = Path(LaunchConfiguration("robot").perform(context)).resolve()
    tag = Path(LaunchConfiguration("tag").perform(context))
    controllers = LaunchConfiguration("controllers").perform(context)
    description = ParameterValue(robot_description(robot, tag), value_type=str)
    return [
        Node(
            package="robot_state_publisher",
            executable="robot_state_publisher",
            parameters=[{"robot_description": description}],
        ),
        Node(
            package="controller_manager",
            executable="ros2_control_node",
            parameters=[controllers],
            output="screen",
        ),
        Node(
            package="controller_manager",
            executable="spawner",
            arguments=[*CONTROLLERS, "--param-file", controllers],
        ),
    ]


def generate_launch_description():
    """Returns the launch description."""
    defaults = {
        "robot": ("robots/kr210", "folder of the robot, with robot.toml and the URDF of its name"),
        "tag": ("description/kr210.ros2_control.urdf", "file with the ros2_control tag"),
        "controllers": ("config/kr210_controllers.yaml", "parameters of the controllers"),
    }
    arguments = [
        DeclareLaunchArgument(name, default_value=str(SHARE / path), description=text)
        for name, (path, text) in defaults.items()
    ]
    return LaunchDescription([*arguments, OpaqueFunction(function=nodes)])
