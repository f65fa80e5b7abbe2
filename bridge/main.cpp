// SPDX-License-Identifier: Apache-2.0
#include <iostream>

#include "bridge/join/join.hpp"
#include "bridge/net/certificate.hpp"
#include "bridge/serve/serve.hpp"
#include "shared/posix/program.hpp"
#include "shared/posix/stop_signals.hpp"
#include "shared/text/command_line.hpp"

namespace {

using namespace kerf;
using namespace kerf::bridge;

Arguments add_serve(CommandLine& app, ServeOptions& options) {
  Arguments serve =
      app.command("serve", "Shows a running kerf-controller to browsers and to join.");
  serve.option("--listen", options.listen, "HOST:PORT; off loopback TLS 1.3, always")
      .shows_default();
  serve.option("--name", options.name, "name of the controller").shows_default();
  serve.option("--identity", options.identity, "folder of make-identity; else self-signed");
  serve.option("--token-file", options.token_file,
               "who may look, as often as they like: one token a line");
  serve.option("--allow-commands", options.command_tokens, "who may command too: one token a line");
  serve.option("--max-viewers", options.max_viewers, "at once")
      .within(1, kMostViewers)
      .shows_default();
  serve.flag("--dedicated-link", options.dedicated_link,
             "nobody else uses the link: fresher under loss, unfair to others");
  serve
      .option("--openigtlink", options.openigtlink,
              "port for 3D Slicer at the same host: send only, no token, no encryption")
      .within(1, 65535);
  serve.flag("--qr", options.qr, "the address as a QR code, for a tablet");
  return serve;
}

Arguments add_join(CommandLine& app, JoinOptions& options) {
  Arguments join = app.command("join", "Repeats a far controller's segment here, for all readers.");
  join.option("address", options.address, "what serve prints: wss://HOST:PORT/?token=TOKEN")
      .required();
  join.option("--name", options.name, "of the segment here, as readers ask for it").shows_default();
  join.option("--ca", options.ca, "ca.pem of the lab that vouches for the server").shown_as("FILE");
  join.option("--fingerprint", options.fingerprint,
              "of the server's certificate, as serve or make-identity prints it")
      .shown_as("SHA256");
  join.option("--token-file", options.token_file,
              "the token, if not in the address, where other users see it")
      .shown_as("FILE");
  join.option("--wait", options.wait_s, "seconds for the first picture; else for ever")
      .within(0, 86'400)
      .shown_as("S");
  join.option("--most-mib", options.most_mib, "a larger segment is refused")
      .within(1, 65536)
      .shows_default();
  return join;
}

void add_make_identity(CommandLine& app, IdentityOptions& options) {
  Arguments make =
      app.command("make-identity", "Makes a lab's CA, and a certificate of a machine.");
  make.option("folder", options.folder, "where they go").required();
  make.option("--host", options.hosts, "name or address of the machine; may be given often")
      .one_each();
  make.option("--days", options.days, "that the certificate holds").within(1, 3650).shows_default();
}

int run(int argc, char** argv) {
  ServeOptions serve_options;
  JoinOptions join_options;
  IdentityOptions identity_options;
  CommandLine app("Carries the picture of a kerf-controller to other machines.", "kerf-bridge",
                  KERF_VERSION);
  const Arguments serve = add_serve(app, serve_options);
  const Arguments join = add_join(app, join_options);
  add_make_identity(app, identity_options);
  if (!app.parse(argc, argv, std::cout)) return 0;
  if (serve.chosen()) return run_serve(serve_options, catch_stop_signals());
  if (join.chosen()) return run_join(join_options, catch_stop_signals(), std::cout);
  return run_make_identity(identity_options);
}

}  // namespace

int main(int argc, char** argv) {
  return run_program("kerf-bridge", [&] { return run(argc, argv); });
}
