#pragma once

#include <cstddef>
#include <memory>
#include <string>

#include <ensonify/engine/live/session.h>

namespace ensonify::engine {

struct ServerOptions {
  std::string bind = "127.0.0.1";
  int port = 0;         ///< 0: any that is free
  bool remote = false;  ///< whether it may be heard beyond this machine
};

/// Whether this build has a server (cpp-httplib was there).
bool has_live_server();

/// Whether nothing but this machine can reach an address: 127.x.y.z, ::1 or localhost.
bool is_loopback(const std::string& address);

/// A page over a session, on threads of its own. It answers GET for the page and its two files,
/// /lines (frames.h, until the page leaves) and /truth, and POST for /change; and refuses whatever
/// is not asked by the page itself: another Host than this server's own, another Origin or site, a
/// missing token (which the page holds and another site cannot read), other methods and paths,
/// requests that are large or slow, and more readers than there is room for.
class LiveServer {
 public:
  /// Throws std::invalid_argument for an address that others could reach unless that is wanted,
  /// std::runtime_error for a port that is taken and in a build without a server.
  LiveServer(LiveSession& session, const ServerOptions& options);
  ~LiveServer();  ///< lets go of all pages
  LiveServer(const LiveServer&) = delete;
  LiveServer& operator=(const LiveServer&) = delete;

  int port() const;
  std::string address() const;  ///< as a browser wants it, with http:// and a / at its end

 private:
  struct Inner;
  std::unique_ptr<Inner> inner_;
};

}  // namespace ensonify::engine
