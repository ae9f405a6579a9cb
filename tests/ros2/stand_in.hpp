// What the plugin uses of ROS 2, in the least form that runs: names and signatures are ROS's, nothing else is.
#pragma once
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <type_traits>
#include <variant>
#include <vector>

namespace std_msgs::msg
{
struct Float64MultiArray
{
  std::vector<double> data;
};
struct Int64
{
  int64_t data = 0;
};
}  // namespace std_msgs::msg

namespace rclcpp
{
struct Duration
{
  int64_t nanoseconds = 0;
  double seconds() const { return static_cast<double>(nanoseconds) * 1e-9; }
};
struct Time
{
  int64_t nanoseconds = 0;
  Duration operator-(const Time & other) const { return {nanoseconds - other.nanoseconds}; }
};
struct Logger
{
};
struct Parameter
{
  std::variant<std::vector<std::string>, int64_t> value;
  std::vector<std::string> as_string_array() const { return std::get<0>(value); }
  int64_t as_int() const { return std::get<1>(value); }
};
template <typename M>
struct Subscription
{
  using SharedPtr = std::shared_ptr<Subscription>;
  std::function<void(const M &)> call;
};
template <typename M>
struct Publisher
{
  using SharedPtr = std::shared_ptr<Publisher>;
  M last;
  void publish(const M & message) { last = message; }
};
struct TimerBase
{
  using SharedPtr = std::shared_ptr<TimerBase>;
  std::function<void()> call;
};
}  // namespace rclcpp

#define RCLCPP_ERROR(logger, ...) ((void)(logger), std::fprintf(stderr, __VA_ARGS__))
#define RCLCPP_WARN(logger, ...) ((void)(logger), std::fprintf(stderr, __VA_ARGS__))

namespace rclcpp_lifecycle
{
struct State
{
};
struct LifecycleNode
{
  std::map<std::string, rclcpp::Parameter> parameters;
  std::map<std::string, std::function<void(const std_msgs::msg::Float64MultiArray &)>> topics;
  rclcpp::TimerBase::SharedPtr timer;
  rclcpp::Logger get_logger() const { return {}; }
  rclcpp::Parameter get_parameter(const std::string & name) const { return parameters.at(name); }
  template <typename M, typename Call>
  std::shared_ptr<rclcpp::Subscription<M>> create_subscription(
    const std::string & topic, int, Call call)
  {
    topics[topic] = call;
    return std::make_shared<rclcpp::Subscription<M>>();
  }
  template <typename M>
  std::shared_ptr<rclcpp::Publisher<M>> create_publisher(const std::string &, int)
  {
    return std::make_shared<rclcpp::Publisher<M>>();
  }
  template <typename Call>
  rclcpp::TimerBase::SharedPtr create_wall_timer(std::chrono::milliseconds, Call call)
  {
    return timer = std::make_shared<rclcpp::TimerBase>(rclcpp::TimerBase{call});
  }
};
}  // namespace rclcpp_lifecycle

namespace hardware_interface
{
struct LoanedStateInterface
{
  double * value;
  [[nodiscard]] std::optional<double> get_optional() const
  {
    return value ? std::optional<double>(*value) : std::nullopt;
  }
};
struct LoanedCommandInterface
{
  double * value;
  [[nodiscard]] bool set_value(double x)
  {
    *value = x;
    return true;
  }
};
}  // namespace hardware_interface

namespace controller_interface
{
enum class CallbackReturn : uint8_t { SUCCESS, FAILURE, ERROR };
enum class return_type : uint8_t { OK = 0, ERROR = 1 };
enum class interface_configuration_type : uint8_t { ALL, INDIVIDUAL, NONE };
struct InterfaceConfiguration
{
  interface_configuration_type type;
  std::vector<std::string> names;
};
class ControllerInterface
{
public:
  virtual ~ControllerInterface() = default;
  virtual CallbackReturn on_init() = 0;
  virtual InterfaceConfiguration command_interface_configuration() const = 0;
  virtual InterfaceConfiguration state_interface_configuration() const = 0;
  virtual CallbackReturn on_configure(const rclcpp_lifecycle::State &) = 0;
  virtual CallbackReturn on_cleanup(const rclcpp_lifecycle::State &) = 0;
  virtual CallbackReturn on_activate(const rclcpp_lifecycle::State &) = 0;
  virtual return_type update(const rclcpp::Time &, const rclcpp::Duration &) = 0;
  std::shared_ptr<rclcpp_lifecycle::LifecycleNode> get_node() const { return node_; }
  std::vector<hardware_interface::LoanedCommandInterface> command_interfaces_;
  std::vector<hardware_interface::LoanedStateInterface> state_interfaces_;

protected:
  template <typename T>
  void auto_declare(const std::string & name, const T & value)
  {
    node_->parameters.insert({name, rclcpp::Parameter{value}});
  }

private:
  std::shared_ptr<rclcpp_lifecycle::LifecycleNode> node_ =
    std::make_shared<rclcpp_lifecycle::LifecycleNode>();
};
}  // namespace controller_interface

#define PLUGINLIB_EXPORT_CLASS(type, base) \
  std::unique_ptr<base> make_plugin() { return std::make_unique<type>(); }
