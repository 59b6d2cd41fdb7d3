// Buttons, slider, keys and the address: everything that steers a player and shows how it stands.

const SPEEDS = [0.5, 1, 2, 4, 8, 16, 32];

class Controls {
  constructor(player, figures) {
    this.player = player;
    this.figures = figures;
    this.parts = {};
    for (const part of document.querySelectorAll("[id]")) this.parts[part.id] = part;
    this.saying = 0;
    this.listen();
    player.addEventListener("state", () => this.showState());
    player.addEventListener("moment", () => this.showMoment());
    player.addEventListener("moved", () => this.remember());
  }

  listen() {
    const { player, parts } = this;
    const press = (id, deed) => parts[id].addEventListener("click", deed);
    press("play", () => player.toggle());
    press("back", () => this.jump(-10));
    press("on", () => this.jump(10));
    press("closer", () => this.zoom(1.4));
    press("farther", () => this.zoom(1 / 1.4));
    press("fit", () => this.fit());
    press("share", () => this.share());
    press("collision", () => this.nextCollision());
    press("curve", (event) => {
      const { left, width } = parts.curve.getBoundingClientRect();
      player.seek(Math.round(((event.clientX - left) / width) * Number(parts.time.max)));
      this.settle();
    });
    parts.time.addEventListener("input", () => {
      player.seek(Number(parts.time.value));
      this.settle();
    });
    parts.speed.addEventListener("change", () => this.setSpeed(Number(parts.speed.value)));
    parts.follow.addEventListener("change", () => this.follow(parts.follow.value.trim()));
    for (const box of document.querySelectorAll("input[data-shows]")) {
      box.addEventListener("change", () => {
        player.shown[box.dataset.shows] = box.checked;
        player.ask();
      });
    }
    document.addEventListener("keydown", (event) => this.key(event));
    window.addEventListener("hashchange", () => {
      goTo(player, window.location.hash);
      this.showState();
    });
    window.addEventListener("resize", () => this.fresh());
    document.addEventListener("theme", () => this.fresh());
  }

  key(event) {
    if (event.altKey || event.ctrlKey || event.metaKey) return;
    const { tagName, type } = event.target;
    if (event.key !== "Escape" && (tagName === "SELECT" || (tagName === "INPUT" && type !== "range" && type !== "checkbox"))) return;
    const pressed = tagName === "BUTTON" || type === "checkbox" || tagName === "SUMMARY";
    const far = event.shiftKey ? 10 : 1;
    const deeds = {
      " ": () => !pressed && (this.player.toggle(), true),
      k: () => (this.player.toggle(), true),
      ArrowLeft: () => (this.jump(-far), true),
      ArrowRight: () => (this.jump(far), true),
      Home: () => (this.jump(-Infinity), true),
      End: () => (this.jump(Infinity), true),
      "+": () => (this.zoom(1.4), true),
      "=": () => (this.zoom(1.4), true),
      "-": () => (this.zoom(1 / 1.4), true),
      0: () => (this.fit(), true),
      "<": () => (this.faster(-1), true),
      ">": () => (this.faster(1), true),
      f: () => (this.followNext(), true),
      c: () => (this.nextCollision(), true),
      Escape: () => (this.follow(""), true),
    };
    const deed = deeds[event.key.length === 1 ? event.key.toLowerCase() : event.key];
    if (deed && deed()) event.preventDefault();
  }

  jump(seconds) {
    this.player.skip(seconds);
    this.settle();
  }

  zoom(factor) {
    const [stage] = this.player.stages;
    this.player.camera.zoomBy(factor, stage.width, stage.height);
    this.player.ask();
    this.remember();
  }

  fit() {
    this.player.follow("");
    this.player.camera.reset();
    this.player.ask();
    this.remember();
  }

  setSpeed(speed) {
    this.player.speed = speed;
    this.parts.speed.value = String(speed);
  }

  faster(by) {
    const next = SPEEDS.indexOf(this.player.speed) + by;
    if (SPEEDS[next]) this.setSpeed(SPEEDS[next]);
  }

  follow(name) {
    if (name && !this.player.knows(name)) {
      this.say(`There is no vehicle ${name}; click one, or choose from the list.`);
      return;
    }
    this.player.follow(name);
    this.settle();
  }

  // The next RV on the road, in the order in which they came; where there is none, the next vehicle.
  followNext() {
    const [{ cast, episode }] = this.player.stages;
    const here = [...cast.shown.slice(0, cast.count)].sort((one, other) => one - other);
    const robots = here.filter((vehicle) => episode.vehicles.robot[vehicle]);
    const among = robots.length ? robots : here;
    if (!among.length) return;
    const now = episode.index.get(this.player.followed);
    const next = among.find((vehicle) => vehicle > now) ?? among[0];
    this.follow(episode.vehicles.id[now === undefined ? among.at(-1) : next]); // who came last stays longest
  }

  nextCollision() {
    const moments = this.player.stages.flatMap(({ episode }) => episode.collisions.map((one) => one.first));
    if (!moments.length) {
      this.say("Nobody collides.");
      return;
    }
    moments.sort((one, other) => one - other);
    this.player.seek(moments.find((moment) => moment > this.player.step + 1e-6) ?? moments[0]);
    this.settle();
  }

  async share() {
    if (this.player.playing) this.player.toggle(); // or the moment is gone
    this.remember();
    try {
      await navigator.clipboard.writeText(window.location.href);
      this.say("The link to this moment is copied.");
    } catch {
      this.say("The address bar has the link to this moment.");
    }
  }

  // The address shows the moment, as far as the page has one of its own.
  remember() {
    if (this.player.playing) return;
    try {
      window.history.replaceState(null, "", `#${fragment(this.player)}`);
    } catch {
      // a frame without an address
    }
  }

  say(text) {
    clearTimeout(this.saying); // of what was about to be said
    this.parts.said.textContent = text;
  }

  // After something was chosen: the address and, when it has come to rest, words for screen readers.
  settle() {
    this.remember();
    clearTimeout(this.saying);
    this.saying = setTimeout(() => this.say(this.player.playing ? "" : this.words()), 400);
  }

  words() {
    const step = Math.floor(this.player.step);
    return this.figures.map((one) => {
      const now = one.at(step);
      return `${one.episode.record.controller} at ${clock(this.player.time())}: ${now.vehicles} vehicles, `
        + `mean waiting ${number(now.waiting, 1)} seconds, ${now.collisions} collisions.`;
    }).join(" ");
  }

  showState() {
    const { player, parts } = this;
    parts.play.classList.toggle("playing", player.playing);
    parts.play.setAttribute("aria-label", player.playing ? "Pause" : "Play");
    if (parts.follow.value !== player.followed) parts.follow.value = player.followed;
    this.settle();
  }

  showMoment() {
    const { player, parts } = this;
    const step = Math.floor(player.step + 1e-6);
    parts.time.value = String(player.step);
    parts.time.setAttribute("aria-valuetext", `${clock(player.time())}, ${player.time() < player.episode.warm_up ? "warm-up" : "counts"}`);
    write(parts.now, clock(player.time()));
    for (const one of this.figures) {
      one.show(step);
      write(one.cells.followed, player.followed ? one.tell(step, player.followed) : "");
    }
  }

  // The window or the theme has changed.
  fresh() {
    for (const stage of this.player.stages) stage.resize();
    write(this.parts.highest, `waiting now, up to ${number(drawTimeline(this.parts.curve, this.player.stages.map((one) => one.episode)), 0)} s`);
    this.player.ask();
  }
}
