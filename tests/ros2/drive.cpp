// Drives the plugin as a controller manager does: states from standard input, torques to standard output.
#include <cstdlib>
#include <new>

#include "stand_in.hpp"

#include "controller.h"

std::unique_ptr<controller_interface::ControllerInterface> make_plugin();

static long made = 0;

void * operator new(std::size_t size)
{
  made++;
  if (void * found = std::malloc(size)) {
    return found;
  }
  throw std::bad_alloc();
}
void operator delete(void * given) noexcept { std::free(given); }
void operator delete(void * given, std::size_t) noexcept { std::free(given); }

int main()
{
  using controller_interface::CallbackReturn;
  enum { N = CONTROLLER_N };
  double given[1 + 2 * N], told[1 + N];
  auto plugin = make_plugin();
  if (
    plugin->on_init() != CallbackReturn::SUCCESS ||
    plugin->on_configure({}) != CallbackReturn::SUCCESS) {
    return 1;
  }
  const auto states = plugin->state_interface_configuration().names;
  const auto commands = plugin->command_interface_configuration().names;
  for (int i = 0; i < N; i++) {
    std::fprintf(stderr, "%s %s %s\n", states[2 * i].c_str(), states[2 * i + 1].c_str(),
      commands[i].c_str());
    plugin->state_interfaces_.push_back({&given[1 + i]});
    plugin->state_interfaces_.push_back({&given[1 + N + i]});
    plugin->command_interfaces_.push_back({&told[1 + i]});
  }
  plugin->on_activate({});
  const int64_t begun = 1'800'000'000'000'000'000;
  auto & topics = plugin->get_node()->topics;
  for (int k = 0; std::fread(given, sizeof *given, 1 + 2 * N, stdin) == 1 + 2 * N; k++) {
    if (k == 20) {
      topics.at("~/hand/target")({{0.4, 0.1, 0.5}});
      topics.at("~/hand/target")({{0.4, 0.1}});
    }
    if (k == 40) {
      topics.at("~/posture/presence")({{0.0, 0.02}});
    }
    const long before = made;
    const auto answer = plugin->update({begun + k * 1'000'000L}, {1'000'000L});
    if (made != before) {
      return 2;
    }
    told[0] = static_cast<double>(answer);
    std::fwrite(told, sizeof *told, 1 + N, stdout);
  }
  plugin->get_node()->timer->call();
  plugin->on_cleanup({});
  return 0;
}
