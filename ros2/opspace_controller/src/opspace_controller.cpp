// A controller of opspace, exported to C, as a plugin of ros2_control.
//
// Positions and velocities of the joints come in, efforts go out. update neither allocates nor locks nor
// logs: what is asked for by topics goes through the ring of the C library, and what has happened is left
// in a number that a timer of the node publishes.
#include <atomic>
#include <cctype>
#include <chrono>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "controller_interface/controller_interface.hpp"
#include "pluginlib/class_list_macros.hpp"
#include "rclcpp/rclcpp.hpp"
#include "rclcpp_lifecycle/state.hpp"
#include "std_msgs/msg/float64_multi_array.hpp"
#include "std_msgs/msg/int64.hpp"

#include "controller.h"

namespace opspace_controller
{
using controller_interface::CallbackReturn;
using controller_interface::InterfaceConfiguration;
using controller_interface::interface_configuration_type;
using controller_interface::return_type;
using Numbers = std_msgs::msg::Float64MultiArray;

class OpspaceController : public controller_interface::ControllerInterface
{
public:
  CallbackReturn on_init() override
  {
    std::vector<std::string> joints(controller.joint, controller.joint + controller.n);
    auto_declare<std::vector<std::string>>("joints", joints);
    auto_declare<int64_t>("stop_on", OPSPACE_FAULT | OPSPACE_LIMIT_LOST | OPSPACE_TIME_JUMP);
    return CallbackReturn::SUCCESS;
  }

  InterfaceConfiguration command_interface_configuration() const override
  {
    return {interface_configuration_type::INDIVIDUAL, names({"effort"})};
  }

  InterfaceConfiguration state_interface_configuration() const override
  {
    return {interface_configuration_type::INDIVIDUAL, names({"position", "velocity"})};
  }

  CallbackReturn on_configure(const rclcpp_lifecycle::State &) override
  {
    const auto logger = get_node()->get_logger();
    if (controller.base > 0 || controller.nq != controller.n) {
      RCLCPP_ERROR(logger, "a robot with a floating base needs more than its joints' states");
      return CallbackReturn::ERROR;
    }
    joints_ = get_node()->get_parameter("joints").as_string_array();
    stop_on_ = get_node()->get_parameter("stop_on").as_int();
    if (joints_.size() != static_cast<size_t>(controller.n)) {
      RCLCPP_ERROR(logger, "%zu joints are named, the robot has %d", joints_.size(), controller.n);
      return CallbackReturn::ERROR;
    }
    own_.reset(opspace_open(&controller));
    if (!own_) {
      RCLCPP_ERROR(logger, "no memory, or model and kernels come from different versions");
      return CallbackReturn::ERROR;
    }
    q_.assign(joints_.size(), 0.0);
    v_ = tau_ = q_;
    listen();
    return CallbackReturn::SUCCESS;
  }

  CallbackReturn on_cleanup(const rclcpp_lifecycle::State &) override
  {
    heard_.clear();
    timer_.reset();
    said_.reset();
    own_.reset();
    return CallbackReturn::SUCCESS;
  }

  CallbackReturn on_activate(const rclcpp_lifecycle::State &) override
  {
    opspace_restart(own_.get());
    begins_ = true;
    return CallbackReturn::SUCCESS;
  }

  return_type update(const rclcpp::Time & time, const rclcpp::Duration &) override
  {
    for (size_t i = 0; i < joints_.size(); i++) {
      const auto position = state_interfaces_[2 * i].get_optional();
      const auto velocity = state_interfaces_[2 * i + 1].get_optional();
      if (!position || !velocity) {
        return return_type::ERROR;
      }
      q_[i] = *position;
      v_[i] = *velocity;
    }
    if (begins_) {
      begun_ = time;  // a double resolves what has passed since better than the time of day
      begins_ = false;
    }
    const double t = (time - begun_).seconds();
    const int64_t status = opspace_step(own_.get(), t, q_.data(), v_.data(), tau_.data());
    if (status < 0) {
      return return_type::ERROR;
    }
    status_.fetch_or(status, std::memory_order_relaxed);
    bool written = true;
    for (size_t i = 0; i < joints_.size(); i++) {
      written &= command_interfaces_[i].set_value(tau_[i]);
    }
    return written && !(status & stop_on_) ? return_type::OK : return_type::ERROR;
  }

private:
  struct Close
  {
    void operator()(opspace * own) const { opspace_close(own); }
  };

  std::vector<std::string> names(const std::vector<std::string> & kinds) const
  {
    std::vector<std::string> found;
    for (const auto & joint : joints_) {
      for (const auto & kind : kinds) {
        found.push_back(joint + "/" + kind);
      }
    }
    return found;
  }

  // Topics of every task: ~/TASK/target and ~/TASK/presence, [1 or 0, seconds]; and ~/status.
  void listen()
  {
    for (int task = 0; task < controller.tasks; task++) {
      const auto & one = controller.task[task];
      std::string name = one.name;
      for (char & letter : name) {
        letter = std::isalnum(static_cast<unsigned char>(letter)) ? letter : '_';
      }
      const size_t size = one.position + one.orientation + one.joints;
      if (size > 0) {
        hear("~/" + name + "/target", size, [this, task](const double * x) {
          return opspace_set_target(own_.get(), task, x, nullptr, nullptr);
        });
      }
      hear("~/" + name + "/presence", 2, [this, task](const double * x) {
        return opspace_set_presence(own_.get(), task, x[0] != 0.0, 0.0, x[1]);
      });
    }
    said_ = get_node()->create_publisher<std_msgs::msg::Int64>("~/status", 1);
    timer_ = get_node()->create_wall_timer(std::chrono::milliseconds(100), [this]() {
      std_msgs::msg::Int64 message;
      message.data = status_.exchange(0, std::memory_order_relaxed);
      said_->publish(message);
    });
  }

  template <typename Ask>
  void hear(const std::string & topic, size_t size, Ask ask)
  {
    heard_.push_back(get_node()->create_subscription<Numbers>(
      topic, 10, [this, topic, size, ask](const Numbers & message) {
        const bool fits = message.data.size() == size;
        const int answer = fits ? ask(message.data.data()) : OPSPACE_REFUSED;
        if (answer != 0) {
          RCLCPP_WARN(
            get_node()->get_logger(), "%s: %s", topic.c_str(),
            answer == OPSPACE_BUSY ? "too much is asked for at once" : "refused");
        }
      }));
  }

  std::unique_ptr<opspace, Close> own_;
  std::vector<std::string> joints_;
  std::vector<double> q_, v_, tau_;
  int64_t stop_on_ = 0;
  bool begins_ = true;
  rclcpp::Time begun_;
  std::atomic<int64_t> status_{0};
  std::vector<rclcpp::Subscription<Numbers>::SharedPtr> heard_;
  rclcpp::Publisher<std_msgs::msg::Int64>::SharedPtr said_;
  rclcpp::TimerBase::SharedPtr timer_;
};
}  // namespace opspace_controller

PLUGINLIB_EXPORT_CLASS(
  opspace_controller::OpspaceController, controller_interface::ControllerInterface)
