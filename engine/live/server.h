#pragma once

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
/// /lines (frames.h, until the page is closed) and /truth, and POST for /change. It refuses
/// requests that do not come from its page: with another Host or Origin, from another site, or
/// without the token, which is in the page, where other sites cannot read it. It also refuses other
/// methods and paths, large or slow requests, and too many readers.
class LiveServer {
 public:
  /// Throws std::invalid_argument for an address that other machines can reach, unless `remote` is
  /// set. Throws std::runtime_error if the port is in use or this build has no server.
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
