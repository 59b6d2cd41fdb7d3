// A moment as an address's fragment, and back: #t=312.5&follow=northbound.0.4&x=3&y=-8&zoom=2

function fragment(player) {
  const parts = new URLSearchParams({ t: player.time().toFixed(1) });
  if (player.followed) parts.set("follow", player.followed);
  const { camera } = player;
  if (camera.zoom !== 1) parts.set("zoom", camera.zoom.toFixed(2));
  if (camera.x !== camera.home.x || camera.y !== camera.home.y) {
    parts.set("x", camera.x.toFixed(1));
    parts.set("y", camera.y.toFixed(1));
  }
  return parts.toString();
}

// Whatever makes no sense in a fragment is passed over.
function goTo(player, text) {
  const parts = new URLSearchParams(text.replace(/^#/, ""));
  const given = (name) => (parts.get(name) ? Number(parts.get(name)) : NaN);
  const { camera } = player;
  camera.reset();
  if (given("zoom") > 0) camera.zoom = Math.min(100, Math.max(0.05, given("zoom")));
  if (Math.abs(given("x")) < 1e6) camera.x = given("x");
  if (Math.abs(given("y")) < 1e6) camera.y = given("y");
  player.followed = player.knows(parts.get("follow") || "") ? parts.get("follow") : "";
  if (Number.isFinite(given("t"))) player.seek(player.stepAt(given("t")));
}
