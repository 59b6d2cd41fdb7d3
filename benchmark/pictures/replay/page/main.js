// Unpacks the episodes of the page and puts a player on it.

async function begin() {
  const documents = [...document.querySelectorAll('script[type="application/json"]')];
  const episodes = [];
  for (const one of documents) episodes.push(prepare(await unpack(JSON.parse(one.textContent))));
  const camera = new Camera(episodes[0].ground);
  const elements = [...document.querySelectorAll(".stage")];
  const stages = elements.map((element, order) => new Stage(element, episodes[order], camera));
  const player = new Player(stages, camera);
  const table = document.querySelector(".movements");
  const figures = [...document.querySelectorAll(".episode")].map(
    (element, order) => new Figures(element, table, episodes[order], order),
  );
  const controls = new Controls(player, figures);
  for (const stage of stages) handle(stage, player);
  player.seek(player.stepAt(episodes[0].warm_up));
  goTo(player, window.location.hash);
  controls.fresh();
  controls.showState();
  new ResizeObserver(() => controls.fresh()).observe(document.querySelector(".stages"));
  document.body.classList.add("ready");
  window.rightofway = { player, poseAt }; // for pages around this one, and for tests
}

begin().catch((error) => {
  document.getElementById("said").textContent = `This page cannot be played: ${error.message}`;
  throw error;
});
