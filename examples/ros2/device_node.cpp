// SPDX-License-Identifier: Apache-2.0
// A haptic device of a running controller (docs/own-law.md) as topics of ROS 2, by the names of
// CRTK: measured_cp, measured_cv, measured_cf out, servo_cf in; of two arms arm1/... and arm2/...
// It needs kerf/external.h alone.
//
//     ./kerf demo --scene external --name mine --seconds 60 &
//     ros2 run kerf_device device_node --ros-args -p controller:=mine -p rate_hz:=500.0
#include <chrono>
#include <cmath>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include <geometry_msgs/msg/pose_stamped.hpp>
#include <geometry_msgs/msg/twist_stamped.hpp>
#include <geometry_msgs/msg/wrench_stamped.hpp>
#include <rclcpp/rclcpp.hpp>

#include "messages.hpp"

using geometry_msgs::msg::PoseStamped;
using geometry_msgs::msg::TwistStamped;
using geometry_msgs::msg::WrenchStamped;

class DeviceNode final : public rclcpp::Node {
 public:
  DeviceNode() : Node("kerf_device") {
    const auto name = declare_parameter<std::string>("controller", "kerf");
    const double rate_hz = declare_parameter<double>("rate_hz", 500.0);
    if (const char* const problem = kerf_external_open(&device_, name.c_str())) {
      throw std::runtime_error(problem);
    }
    for (unsigned i = 0; i < device_.arms; ++i) {
      const std::string of = device_.arms == 1 ? "" : "arm" + std::to_string(i + 1) + "/";
      // A force that waits in a queue is an old one.
      arms_.push_back({create_publisher<PoseStamped>(of + "measured_cp", 1),
                       create_publisher<TwistStamped>(of + "measured_cv", 1),
                       create_publisher<WrenchStamped>(of + "measured_cf", 1),
                       create_subscription<WrenchStamped>(
                           of + "servo_cf", 1, [this, i](const WrenchStamped& asked) {
                             const kerf_force force = kerf_ros::force_of(asked);
                             kerf_external_give(&device_, i, &force);
                           })});
    }
    timer_ = create_wall_timer(std::chrono::duration<double>(1 / rate_hz), [this] { publish(); });
  }
  ~DeviceNode() override { kerf_external_close(&device_); }

 private:
  struct Arm {
    rclcpp::Publisher<PoseStamped>::SharedPtr pose;
    rclcpp::Publisher<TwistStamped>::SharedPtr twist;
    rclcpp::Publisher<WrenchStamped>::SharedPtr wrench;
    rclcpp::Subscription<WrenchStamped>::SharedPtr force;
  };

  void publish() {
    for (unsigned i = 0; i < device_.arms; ++i) {
      kerf_report now;
      if (!kerf_external_read(&device_, i, &now)) return rclcpp::shutdown(), void();
      if (std::isnan(now.position_mm[0])) continue;  // not calibrated yet
      PoseStamped pose;
      pose.header.stamp = this->now();
      pose.header.frame_id = "kerf";
      TwistStamped twist;
      WrenchStamped wrench;
      twist.header = wrench.header = pose.header;
      kerf_ros::write_pose(now, pose);
      kerf_ros::write_twist(now, device_.workspace_scale, twist);
      kerf_ros::write_wrench(now, wrench);
      arms_[i].pose->publish(pose);
      if (!std::isnan(now.velocity_mm_per_s[0])) arms_[i].twist->publish(twist);
      arms_[i].wrench->publish(wrench);
    }
  }

  kerf_external device_{};
  std::vector<Arm> arms_;
  rclcpp::TimerBase::SharedPtr timer_;
};

int main(int count, char** words) {
  rclcpp::init(count, words);
  try {
    rclcpp::spin(std::make_shared<DeviceNode>());
  } catch (const std::exception& error) {
    RCLCPP_ERROR(rclcpp::get_logger("kerf_device"), "%s", error.what());
    return 1;
  }
}
