// SPDX-License-Identifier: Apache-2.0
#include <iostream>

#include "bridge/join/join.hpp"
#include "bridge/net/address.hpp"
#include "bridge/serve/serve.hpp"
#include "shared/posix/program.hpp"
#include "shared/posix/stop_signals.hpp"
#include "shared/text/command_line.hpp"

namespace {

using namespace kerf;
using namespace kerf::bridge;

/// Adds the options of the program's own certificate.
template <class Options>
void add_certificate(Arguments& command, Options& options, const char* meaning) {
  Option certificate = command.option("--cert", options.certificate, meaning).shown_as("FILE");
  Option key = command.option("--key", options.key, "PEM file: its key, without a password");
  certificate.needs(key);
  key.shown_as("FILE").needs(certificate);
}

Arguments add_serve(CommandLine& app, ServeOptions& options) {
  Arguments serve =
      app.command("serve", "Shows a running kerf-controller to browsers and to join.");
  serve.option("--listen", options.listen, "HOST:PORT; with TLS 1.3, except on loopback")
      .shows_default();
  serve
      .option("--public-url", options.public_url,
              "of a reverse proxy in front: its address for browsers, as https://lab.example/kerf")
      .shown_as("URL");
  serve.option("--name", options.name, "name of the controller").shows_default();
  add_certificate(serve, options, "PEM file: certificate, then those above it; else self-signed");
  serve
      .option("--client-ca", options.client_ca,
              "PEM file: only viewers whose certificate it signed may connect")
      .shown_as("FILE");
  serve.option("--token-file", options.token_file,
               "tokens that may watch, any number of times: one a line");
  serve.option("--allow-commands", options.command_tokens,
               "tokens that may also command: one a line");
  serve.option("--max-viewers", options.max_viewers, "at once")
      .within(1, kMostViewers)
      .shows_default();
  serve.flag("--dedicated-link", options.dedicated_link,
             "the link has no other users: fresher under loss, unfair to others");
  serve
      .option("--openigtlink", options.openigtlink,
              "port for 3D Slicer at the same host: send only, no token, no encryption")
      .within(1, 65535);
  serve.flag("--qr", options.qr, "the address as a QR code, for a tablet");
  return serve;
}

void add_join(CommandLine& app, JoinOptions& options) {
  Arguments join = app.command(
      "join",
      "Copies the segment of a controller on another machine to this one, for all readers.");
  join.option("address", options.address, "what serve prints: wss://HOST:PORT/?token=TOKEN")
      .required();
  join.option("--name", options.name, "name of the segment on this machine").shows_default();
  join.option("--ca", options.ca, "PEM file: CA that signed the server's certificate")
      .shown_as("FILE");
  join.option("--fingerprint", options.fingerprint,
              "of the server's certificate, as serve prints it")
      .shown_as("SHA256");
  add_certificate(join, options, "PEM file: certificate, if serve has --client-ca");
  join.option("--token-file", options.token_file,
              "the token, if not in the address, where other users see it")
      .shown_as("FILE");
  join.option("--wait", options.wait_s, "seconds to wait for the first picture [no limit]")
      .within(0, 86'400)
      .shown_as("S");
  join.option("--most-mib", options.most_mib, "a larger segment is refused")
      .within(1, 65536)
      .shows_default();
}

int run(int argc, char** argv) {
  ServeOptions serve_options;
  JoinOptions join_options;
  CommandLine app("Carries the picture of a kerf-controller to other machines.", "kerf-bridge",
                  KERF_VERSION);
  const Arguments serve = add_serve(app, serve_options);
  add_join(app, join_options);
  if (!app.parse(argc, argv, std::cout)) return 0;
  if (serve.chosen()) return run_serve(serve_options, catch_stop_signals());
  return run_join(join_options, catch_stop_signals(), std::cout);
}

}  // namespace

int main(int argc, char** argv) {
  return run_program("kerf-bridge", [&] { return run(argc, argv); });
}
