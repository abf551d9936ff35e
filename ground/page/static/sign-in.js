// Signs in by the token behind `#` of the address that `ground serve` printed; it never leaves the browser in an address.
const token = location.hash.slice(1);
if (token) {
  history.replaceState(null, "", location.pathname);
  document.getElementById("token").value = token;
  document.getElementById("form").submit();
}
