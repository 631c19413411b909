#pragma once

#include <cstddef>
#include <memory>
#include <string>

#include <ensonify/engine/live/session.h>

namespace ensonify::engine {

struct ServerOptions {
  std::string bind = "127.0.0.1";
  int port = 0;         ///< 0: any free one
  bool remote = false;  ///< allow addresses that other machines can reach
};

/// Whether this build has a server (that is, cpp-httplib).
bool has_live_server();

/// Whether only this machine can reach an address: 127.x.y.z, ::1 or localhost.
bool is_loopback(const std::string& address);

/// Serves the page of a session, on its own threads. It answers GET for the page's files (page.h),
/// /lines (frames.h, until the page leaves) and /truth, and POST for /change. It refuses requests
/// that do not come from its page: another Host or Origin, a cross-site request, a missing token
/// (which is in the page, where other sites cannot read it), other methods or paths, large or slow
/// requests, and too many readers.
class LiveServer {
 public:
  /// Throws std::invalid_argument for an address that other machines can reach unless `remote`,
  /// std::runtime_error if the port is taken or this build has no server.
  LiveServer(LiveSession& session, const ServerOptions& options);
  ~LiveServer();  ///< disconnects all pages
  LiveServer(const LiveServer&) = delete;
  LiveServer& operator=(const LiveServer&) = delete;

  int port() const;
  std::string address() const;  ///< as a URL: "http://127.0.0.1:8347/"

 private:
  struct Inner;
  std::unique_ptr<Inner> inner_;
};

}  // namespace ensonify::engine
