// SPDX-License-Identifier: Apache-2.0

#include "bridge/serve/serve.hpp"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cstdint>
#include <iostream>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include <boost/asio/ip/address.hpp>

#include "bridge/igtl/igtl_output.hpp"
#include "bridge/net/address.hpp"
#include "bridge/serve/server.hpp"
#include "bridge/stream/run_snapshot.hpp"
#include "shared/posix/error_text.hpp"

#ifdef KERF_QRENCODE
#include <memory>

#include <qrencode.h>
#endif

namespace kerf::bridge {

#ifdef KERF_QRENCODE
namespace {

constexpr int kMargin = 4;  // required by the standard
constexpr const char* kBlackOnWhite = "\033[30;107m";
constexpr const char* kUsual = "\033[0m\n";

}  // namespace

std::string qr_code(const std::string& text) {
  const std::unique_ptr<QRcode, void (*)(QRcode*)> code(
      QRcode_encodeString8bit(text.c_str(), 0, QR_ECLEVEL_L), QRcode_free);
  if (code == nullptr) return "no QR code: the address is too long for one\n";
  const auto is_black = [&](int x, int y) {
    if (x < 0 || y < 0 || x >= code->width || y >= code->width) return false;
    return (code->data[y * code->width + x] & 1) != 0;
  };
  std::string lines;
  for (int y = -kMargin; y < code->width + kMargin; y += 2) {
    lines += kBlackOnWhite;
    for (int x = -kMargin; x < code->width + kMargin; ++x) {
      const bool above = is_black(x, y), below = is_black(x, y + 1);
      lines += above ? (below ? "\u2588" : "\u2580") : (below ? "\u2584" : " ");
    }
    lines += kUsual;
  }
  return lines;
}
#else
std::string qr_code(const std::string&) {
  return "no QR code: this kerf-bridge was built without libqrencode-dev\n";
}
#endif

namespace {

struct HostPort {
  std::string host;
  std::uint16_t port = 0;
};

/// Parses `HOST:PORT`, with an IPv6 address in brackets.
HostPort parse_listen(const std::string& text) {
  const auto refuse = [&text](const char* why) {
    return BridgeError("--listen " + text + ": " + why + "; give HOST:PORT, as 127.0.0.1:7400");
  };
  const std::size_t colon = text.rfind(':');
  if (colon == std::string::npos || text.ends_with(']')) throw refuse("has no port");
  HostPort out{text.substr(0, colon), 0};
  if (out.host.starts_with('[') && out.host.ends_with(']')) {
    out.host = out.host.substr(1, out.host.size() - 2);
  } else if (out.host.find(':') != std::string::npos) {
    throw refuse("an IPv6 address stands in brackets");
  }
  if (out.host.empty()) throw refuse("has no host");
  const auto is_letter = [](unsigned char c) { return std::isalpha(c) != 0; };
  if (!is_address(out.host) && std::ranges::none_of(out.host, is_letter)) {
    throw refuse("is no host that another machine can open");  // "*", "0", a number
  }
  boost::system::error_code unnamed;
  const auto address = boost::asio::ip::make_address(out.host, unnamed);
  if (!unnamed && (address.is_multicast() || out.host == "255.255.255.255" ||
                   out.host.find('%') != out.host.npos)) {
    throw refuse("is no address of one machine");
  }
  const char* const end = text.data() + text.size();
  const auto [stopped, error] = std::from_chars(text.data() + colon + 1, end, out.port);
  if (error != std::errc() || stopped != end) throw refuse("the port is 0 to 65535");
  return out;
}

/// The addresses of a server that listens on `host`: `host`, or all addresses of this machine.
[[nodiscard]] std::vector<std::string> reached_at(const std::string& host) {
  if (host != "0.0.0.0" && host != "::") return {host};
  std::vector<std::string> out = own_addresses();
  if (host == "0.0.0.0") {
    std::erase_if(out, [](const std::string& one) { return one.find(':') != std::string::npos; });
  }
  return out;
}

/// Empty (no TLS) on loopback, unless a certificate or a CA is given.
[[nodiscard]] Tls tls_of(const ServeOptions& options, const std::string& host) {
  if (is_loopback(host) && options.certificate.empty() && options.client_ca.empty()) return nullptr;
  Tls tls = new_tls();
  if (options.certificate.empty()) {
    show_self_signed(tls.get(), own_hosts());
  } else {
    show_certificate(tls.get(), options.certificate, options.key);
  }
  if (!options.client_ca.empty()) require_client_certificate(tls.get(), options.client_ca);
  return tls;
}

/// The server's public addresses: that of the proxy, else those of `--listen`.
[[nodiscard]] std::vector<BridgeAddress> places_of(const ServerSetup& setup, std::uint16_t port) {
  if (setup.public_url) return {*setup.public_url};
  std::vector<BridgeAddress> out;
  for (std::string& host : reached_at(setup.host)) {
    out.push_back({setup.tls != nullptr, std::move(host), std::to_string(port), {}, {}});
  }
  return out;
}

/// Prints the page's addresses for one browser. The QR code is for a browser on another machine.
void print_pages(const ServerSetup& setup, std::uint16_t port, const std::string& page_token,
                 bool qr) {
  std::string for_others;
  for (const BridgeAddress& place : places_of(setup, port)) {
    const std::string address = place.origin() + place.path + "/?token=" + page_token;
    if (for_others.empty() && !is_loopback(place.host)) for_others = address;
    std::cout << address << '\n';
  }
  if (qr && !for_others.empty()) std::cout << qr_code(for_others);
}

void print_addresses(const ServerSetup& setup, std::uint16_t port, const std::string& page_token,
                     bool qr) {
  std::cout
      << "for kerf bridge join, any number of times; for Foxglove, write foxglove before the ?\n";
  for (const BridgeAddress& place : places_of(setup, port)) {
    std::cout << (place.secure ? "wss://" : "ws://") << place.host_and_port() << place.path
              << "/?token=" << setup.tokens.first() << '\n';
  }
  if (setup.tokens.may_command()) {
    std::cout << "with a token of --allow-commands in its place a viewer may command, too\n";
  }
  std::cout << "for one browser; the next one gets another address\n";
  print_pages(setup, port, page_token, qr);
}

}  // namespace

int run_serve(const ServeOptions& options, const std::atomic<bool>& stop) {
  const HostPort at = parse_listen(options.listen);
  ServerSetup setup;
  if (!options.public_url.empty()) setup.public_url = parse_public_url(options.public_url);
  setup.host = at.host;
  setup.port = at.port;
  setup.name = options.name;
  static_assert(kMostViewers <= RunSnapshot::kMaxStreams);  // each stream pins a block at most once
  setup.max_viewers = static_cast<std::size_t>(options.max_viewers);
  setup.dedicated_link = options.dedicated_link;
  if (options.token_file.empty()) {
    setup.tokens.add(new_token(), Right::look);
  } else {
    setup.tokens.add_file(options.token_file, "--token-file", Right::look);
  }
  if (!options.command_tokens.empty()) {
    setup.tokens.add_file(options.command_tokens, "--allow-commands", Right::command);
  }
  setup.host_names = own_hosts();
  setup.host_names.push_back(at.host);
  setup.tls = tls_of(options, at.host);
  if (setup.tls) {
    for (std::string& name : dns_names_of(setup.tls.get())) {
      setup.host_names.push_back(std::move(name));
    }
  }
  std::uint16_t port = 0;
  setup.on_page_token = [&setup, &port, qr = options.qr](const std::string& token) {
    std::cout << "for the next browser\n";
    print_pages(setup, port, token, qr);
    std::cout.flush();
  };
  Server server(setup);
  port = server.port();
  std::optional<IgtlOutput> slicer;
  if (options.openigtlink != 0) {
    const auto slicer_port = static_cast<std::uint16_t>(options.openigtlink);
    slicer.emplace(
        IgtlOptions{.host = server.address(), .port = slicer_port, .name = options.name});
    std::cout << "OpenIGTLink, for whoever reaches it, "
              << options.listen.substr(0, options.listen.rfind(':')) << ':' << slicer_port << '\n';
  }
  if (setup.tls) {
    std::cout << "certificate" << (options.certificate.empty() ? ", self-signed," : "")
              << " SHA-256 " << fingerprint_of(setup.tls.get()) << '\n';
  }
  print_addresses(setup, port, server.page_token(), options.qr);
  // A server is of no use if its addresses could not be printed.
  if (const std::string why = stdout_error(std::cout); !why.empty()) throw BridgeError(why);
  server.run(stop);
  return 0;
}

}  // namespace kerf::bridge
