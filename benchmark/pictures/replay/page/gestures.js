// A stage under mouse, finger and wheel: drag to move, pinch or wheel to zoom, click to follow.

const CLICK = 5; // pixels that a click may wander

function handle(stage, player) {
  const { canvas, camera } = stage;
  const down = new Map(); // pointers on the canvas
  let wandered = 0;

  const place = (event) => {
    const box = canvas.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  };
  const spread = () => {
    const [[ax, ay], [bx, by]] = [...down.values()];
    return Math.hypot(ax - bx, ay - by);
  };

  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    down.set(event.pointerId, place(event));
    wandered = down.size > 1 ? Infinity : 0;
  });
  canvas.addEventListener("pointermove", (event) => {
    const before = down.get(event.pointerId);
    if (!before) return;
    const apart = down.size === 2 ? spread() : 0;
    const [x, y] = place(event);
    down.set(event.pointerId, [x, y]);
    wandered += Math.hypot(x - before[0], y - before[1]);
    if (wandered < CLICK) return;
    if (down.size === 2 && apart > 0) {
      const [[ax, ay], [bx, by]] = [...down.values()];
      camera.zoomBy(spread() / apart, stage.width, stage.height, (ax + bx) / 2, (ay + by) / 2);
    }
    if (player.followed) player.follow("");
    camera.panBy((x - before[0]) / down.size, (y - before[1]) / down.size, stage.width, stage.height);
    player.ask();
  });
  const up = (event) => {
    if (!down.delete(event.pointerId)) return;
    if (event.type === "pointerup" && wandered < CLICK) player.follow(stage.pick(...place(event)));
    else player.say("moved");
  };
  canvas.addEventListener("pointerup", up);
  canvas.addEventListener("pointercancel", up);
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    const point = player.followed ? [] : place(event);
    camera.zoomBy(Math.exp(-event.deltaY * (event.deltaMode ? 0.05 : 0.0016)), stage.width, stage.height, ...point);
    player.ask();
    player.say("moved");
  }, { passive: false });
  canvas.addEventListener("keydown", (event) => {
    const [dx, dy] = { ArrowLeft: [1, 0], ArrowRight: [-1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key] || [0, 0];
    if ((!dx && !dy) || event.altKey || event.ctrlKey || event.metaKey) return;
    event.preventDefault();
    event.stopPropagation();
    if (player.followed) player.follow("");
    camera.panBy(dx * 40, dy * 40, stage.width, stage.height);
    player.ask();
    player.say("moved");
  });
}
