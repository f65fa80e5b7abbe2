// SPDX-License-Identifier: Apache-2.0
#include "tests/hil/umockdev/umockdev_node.hpp"

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <cstring>
#include <stdexcept>
#include <utility>

#include <sys/ioctl.h>
#include <unistd.h>

#include "hil/front/fuse/fuse_channel.hpp"
#include "hil/front/serving.hpp"
#include "shared/posix/monotonic_clock.hpp"

namespace kerf::test {
namespace {

UmockdevNode& node_of(gpointer self) {
  return *static_cast<UmockdevNode*>(self);
}

/// The third argument of ioctl().
std::uint64_t argument_of(UMockdevIoctlClient* client) {
  std::uint64_t argument = 0;
  std::memcpy(&argument, umockdev_ioctl_client_get_arg(client)->data, sizeof argument);
  return argument;
}

void end(UMockdevIoctlClient* client, const FuseReply& answer) {
  umockdev_ioctl_client_complete(client, answer.error == 0 ? answer.result : -1, answer.error);
  g_object_unref(client);
}

}  // namespace

UmockdevNode::UmockdevNode(UMockdevTestbed* bed, const std::string& path, FuseNode& node)
    : node_(node) {
  node_.attach(*this);
  const auto called = +[](UMockdevIoctlBase*, UMockdevIoctlClient* client, gpointer self) {
    node_of(self).take(client);
    return TRUE;
  };
  const auto closed = +[](UMockdevIoctlBase*, UMockdevIoctlClient* client, gpointer self) {
    node_of(self).close(client);
  };
  g_signal_connect(base_, "handle-ioctl", G_CALLBACK(called), this);
  g_signal_connect(base_, "client-vanished", G_CALLBACK(closed), this);
  GError* error = nullptr;
  if (umockdev_testbed_attach_ioctl(bed, path.c_str(), base_, &error)) return;
  const std::string text = error->message;
  g_error_free(error);
  throw std::runtime_error("umockdev: " + path + ": " + text);
}

UmockdevNode::~UmockdevNode() {
  if (frames_) {
    const auto stop = +[](gpointer self) -> gboolean {
      node_of(self).stop();
      return G_SOURCE_REMOVE;
    };
    g_main_context_invoke(g_source_get_context(frames_), stop, this);
    stopped_.get_future().wait();
    g_source_unref(frames_);
  }
  g_object_unref(base_);
}

/// On the bed's thread: nothing of it is under way then, and nothing comes after.
void UmockdevNode::stop() {
  g_source_destroy(frames_);
  g_signal_handlers_disconnect_by_data(base_, this);
  for (UMockdevIoctlClient* const client : waiting_) end(client, FuseReply::fail(ENODEV));
  stopped_.set_value();
}

/// With the first call: the bed's thread is known only on it.
void UmockdevNode::begin() {
  static_cast<void>(make_real_time(82, -1));  // before the servo, where there is the right to it
  frames_ = g_timeout_source_new(1);
  const auto frame = +[](gpointer self) -> gboolean {
    node_of(self).frame();
    return G_SOURCE_CONTINUE;
  };
  g_source_set_callback(frames_, frame, this, nullptr);
  g_source_attach(frames_, g_main_context_get_thread_default());
}

void UmockdevNode::take(UMockdevIoctlClient* client) {
  if (!frames_) begin();
  if (const auto [open, is_new] = opens_.try_emplace(client, last_open_ + 1); is_new) {
    node_.open(++last_open_);
  }
  g_object_ref(client);
  const FuseReply answer = ask(client);
  if (answer.error == EAGAIN) {
    waiting_.push_back(client);
  } else {
    end(client, answer);
  }
}

void UmockdevNode::close(UMockdevIoctlClient* client) {
  const auto open = opens_.find(client);
  if (open == opens_.end()) return;
  node_.release(open->second);
  opens_.erase(open);
}

/// Whoever has waited for this frame gets what there is now.
void UmockdevNode::frame() {
  if (node_.next_wake_ns() <= monotonic_ns()) node_.wake();
  for (UMockdevIoctlClient* const client : std::exchange(waiting_, {})) end(client, ask(client));
}

FuseReply UmockdevNode::ask(UMockdevIoctlClient* client) {
  const auto command = static_cast<std::uint32_t>(umockdev_ioctl_client_get_request(client));
  FuseIoctl call{.thread = getpid(), .command = command, .argument = argument_of(client)};
  std::vector<std::uint8_t> input((_IOC_DIR(command) & _IOC_WRITE) ? _IOC_SIZE(command) : 0);
  if (read_caller(call.thread, call.argument, input) != input.size()) {
    return FuseReply::fail(EFAULT);
  }
  call.input = input;
  if (_IOC_DIR(command) & _IOC_READ) call.output_bytes = _IOC_SIZE(command);
  const FuseReply answer = node_.ioctl(opens_.at(client), call).value_or(FuseReply::fail(ENOTTY));
  const auto output = answer.bytes.first(std::min(answer.bytes.size(), call.output_bytes));
  const bool told = output.empty() || write_caller(call.thread, call.argument, output);
  return told ? answer : FuseReply::fail(EFAULT);
}

}  // namespace kerf::test
